#include "tests/daemon/server/daemon_fixture.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <stdexcept>

#include "config/cell_file.h"
#include "config/job_settings.h"
#include "planner/cell_model/program_file.h"
#include "sampling/base/sha256.h"

namespace hilbrush::test {
namespace {

namespace fs = std::filesystem;

/// Speaks the pipeline's protocol. What planning would make lies prepared beside the submitted model:
/// MODEL.program, MODEL.report.
constexpr const char* kFakePipeline = R"SH(#!/bin/sh
prepared='@PREPARED@'
verb=$1; shift
while [ $# -gt 0 ]; do
  case $1 in
    --model) model=$2; shift 2 ;;
    --output) output=$2; shift 2 ;;
    *) shift ;;
  esac
done
name=$(basename "$model")
case $verb in
  files)
    case $name in
      outside*) echo "{\"result\":{\"files\":[\"$model\",\"/etc/hostname\"]}}" ;;
      *) echo "{\"result\":{\"files\":[\"$model\"]}}" ;;
    esac ;;
  approach)
    case $name in
      lost*) echo '{"error":{"at":"","message":"every way is blocked"}}'; exit 3 ;;
      slowway*) sleep 600 ;;
    esac
    echo '{"result":{"via":[]}}' ;;
  plan | dry-run)
    echo '{"stage":"load","fraction":0}'
    case $name in
      hang*) sleep 600 ;;
      crash*) kill -SEGV $$ ;;
      fat*) exec awk 'BEGIN { s = "a"; while (length(s) < 4e8) s = s s; while (1) ; }' ;;
      bad*) echo '{"error":{"at":"bad.wrl:12","message":"a face has no corners"}}'; exit 3 ;;
      mute*) echo 'out of luck' >&2; exit 1 ;;
      garbage*) echo 'this is not JSON'; sleep 600 ;;
      endless*) head -c 10000000 /dev/zero | tr '\0' 'a'; sleep 600 ;;
    esac
    echo '{"warning":"a texture is missing"}'
    echo '{"stage":"plan","fraction":0.5}'
    cp "$prepared/$name.program" "$output/program.ply" || exit 1
    cat "$prepared/$name.report" ;;
esac
)SH";

void write_file(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

std::string settings_hash() {
  JobSettings settings = job_settings_from_json(R"({"size_mm":80})");
  settings.cell = "-";
  return sha256_hex(job_settings_to_json(settings));
}

}  // namespace

LineClient::LineClient(const fs::path& socket) : fd_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, socket.c_str(), sizeof address.sun_path - 1);
  if (::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return;
  const int error = errno;
  ::close(fd_);
  throw std::runtime_error("no daemon answers on " + socket.string() + ": " + std::strerror(error));
}

std::unique_ptr<LineClient> LineClient::over_tcp(const std::string& address) {
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  place.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::unique_ptr<LineClient> client(new LineClient(fd));
  if (::connect(fd, reinterpret_cast<sockaddr*>(&place), sizeof place) != 0)
    throw std::runtime_error("no daemon answers on " + address + ": " + std::strerror(errno));
  return client;
}

LineClient::~LineClient() {
  ::close(fd_);
}

void LineClient::send_bytes(const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count <= 0) return;  // the daemon closed: what follows will say so
    sent += static_cast<std::size_t>(count);
  }
}

std::size_t LineClient::send_without_waiting(const std::string& bytes) {
  const ssize_t count = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::optional<std::string> LineClient::read_line() {
  for (;;) {
    if (const auto end = inbox_.find('\n'); end != std::string::npos) {
      std::string line = inbox_.substr(0, end);
      inbox_.erase(0, end + 1);
      return line;
    }
    pollfd polled{fd_, POLLIN, 0};
    if (::poll(&polled, 1, static_cast<int>(std::chrono::milliseconds(kPatience).count())) == 0)
      throw std::runtime_error("the daemon did not answer");
    char chunk[65536];
    const ssize_t count = ::recv(fd_, chunk, sizeof chunk, 0);
    if (count <= 0) return std::nullopt;
    inbox_.append(chunk, static_cast<std::size_t>(count));
  }
}

Json LineClient::read_message() {
  const auto line = read_line();
  return line ? Json::parse(*line) : Json();
}

Json LineClient::call(const std::string& method, const Json& params) {
  const int id = ++last_id_;
  send_bytes(Json{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}}.dump() + "\n");
  for (;;) {
    Json message = read_message();
    if (message.is_null()) throw std::runtime_error("the daemon closed the connection");
    if (message.contains("id") && message["id"] == id) return message;
    if (message.contains("method")) updates_.push_back(std::move(message));
  }
}

Json LineClient::result(const std::string& method, const Json& params) {
  const Json answer = call(method, params);
  if (!answer.contains("result")) throw std::runtime_error(method + ": " + answer.dump());
  return answer["result"];
}

int LineClient::error_code(const std::string& method, const Json& params) {
  const Json answer = call(method, params);
  return answer.contains("error") ? answer["error"]["code"].get<int>() : 0;
}

Json LineClient::next_update() {
  if (!updates_.empty()) {
    Json update = updates_.front();
    updates_.erase(updates_.begin());
    return update.at("params");
  }
  for (;;) {
    Json message = read_message();
    if (message.is_null()) throw std::runtime_error("the daemon closed the connection");
    if (message.contains("method")) return message.at("params");
  }
}

void LineClient::end_sending() {
  ::shutdown(fd_, SHUT_WR);
}

DaemonWorld::DaemonWorld() {
  options.socket = folder_ / "socket";
  options.state = folder_ / "state";
  options.cell = std::string(HILBRUSH_SOURCE_DIR) + "/config/cells/default.json";
  options.time_scale = 0;
  options.pipeline = folder_ / "pipeline";
  std::string script = kFakePipeline;
  const std::string mark = "@PREPARED@";
  script.replace(script.find(mark), mark.size(), folder_.path().string());
  write_file(options.pipeline, script);
  fs::permissions(options.pipeline, fs::perms::owner_all);
}

DaemonWorld::~DaemonWorld() {
  end();
}

void DaemonWorld::begin() {
  daemon_ = std::make_unique<Daemon>(options);
  thread_ = std::thread([this] { daemon_->run(); });
}

void DaemonWorld::end() {
  if (!daemon_) return;
  daemon_->end();
  thread_.join();
  daemon_.reset();
}

fs::path DaemonWorld::model(const std::string& name, std::size_t exposures) {
  const fs::path file = folder_ / name;
  const std::string text = "model " + name + "\n";
  write_file(file, text);
  ExposureProgram program = small_program(exposures);
  program.provenance = {sha256_hex(name.starts_with("stray") ? "another" : text), settings_hash(),
                        load_cell(options.cell).sha256, HILBRUSH_VERSION};
  if (name.starts_with("older")) program.provenance.version = "0.0.1";
  if (name.starts_with("long"))
    for (auto& exposure : program.exposures) exposure.pulse_s = .05f;
  if (name.starts_with("wild")) program.exposures[exposures / 2].joints[kJ1] = 100;
  write_program(program, folder_ / (name + ".program"));
  Json report{
      {"result",
       {{"dots",
         {{"placed", exposures + 5}, {"exposed", 0}, {"skipped", {{"occluded", 3}, {"incidence", 2}}}}},
        {"mesh", {{"size_mm", {80, 80, 60}}, {"min_mm", {-40, -40, 0}}, {"max_mm", {40, 40, 60}}}},
        {"skipped",
         Json::array({{{"reason", "occluded"}, {"count", 3}, {"text", "beam blocked by the object"}}})},
        {"suggestion", {{"text", "a post of 90 mm would reach more"}}},
        {"time_s", {{"total", .04 * static_cast<double>(exposures)}}}}}};
  if (name.starts_with("hidden"))
    report["result"]["dots"] = {{"placed", 5}, {"exposed", 0}, {"skipped", {{"occluded", 5}}}};
  write_file(folder_ / (name + ".report"), report.dump() + "\n");
  return file;
}

std::string DaemonWorld::submit(LineClient& client, const fs::path& model, const std::string& state,
                                bool dry_run) {
  const Json job =
      client
          .result("job.submit",
                  {{"model", model.string()}, {"settings", {{"size_mm", 80}}}, {"dry_run", dry_run}})
          .at("job");
  EXPECT_EQ(job.at("state"), "queued");
  const auto id = job.at("id").get<std::string>();
  wait_for(client, id, state);
  return id;
}

Json DaemonWorld::wait_for(LineClient& client, const std::string& id, const std::string& state) {
  const auto deadline = std::chrono::steady_clock::now() + LineClient::kPatience;
  for (;;) {
    const Json job = client.result("job.get", {{"id", id}}).at("job");
    if (job.at("state") == state) return job;
    const auto now = job.at("state").get<std::string>();
    const bool is_final = now == "done" || now == "failed" || now == "cancelled";
    if (is_final || std::chrono::steady_clock::now() > deadline)
      throw std::runtime_error("job " + id + " is not " + state + " but: " + job.dump());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

void DaemonWorld::clear_and_arm(LineClient& client) {
  EXPECT_EQ(client.result("cell.clear").at("cell").at("state"), "idle");
  EXPECT_EQ(client.result("cell.arm").at("cell").at("state"), "armed");
}

}  // namespace hilbrush::test
