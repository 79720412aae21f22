#include "sampling/model/model_folder.h"

#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "sampling/base/input_error.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxUrlBytes = 1024;
constexpr std::size_t kSpellingLimit = 16;  ///< of one url
constexpr std::size_t kChunkBytes = 1 << 18;
constexpr std::size_t kMaxFiles =
    4;  ///< all files of a model are at most this many times as large as one may be

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decoded(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0) {
      out += static_cast<char>(16 * hex_digit(text[i + 1]) + hex_digit(text[i + 2]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

bool has_control_bytes(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; });
}

/// What `url` may mean as a path, most literal first.
std::vector<std::string> spellings(const std::string& url) {
  std::vector<std::string> out{url};
  const auto add = [&](const std::string& text) {
    if (!text.empty() && std::find(out.begin(), out.end(), text) == out.end()) out.push_back(text);
  };
  std::string plain = url.rfind("file:", 0) == 0 ? url.substr(5) : url;
  std::replace(plain.begin(), plain.end(), '\\', '/');
  add(plain);
  add(percent_decoded(plain));
  // Exporters write paths of the machine they ran on; the file may lie here under the end of such a path.
  std::string tail = out.back();
  for (std::size_t slash; out.size() < kSpellingLimit && (slash = tail.find('/')) != tail.npos;) {
    tail.erase(0, slash + 1);
    add(tail);
  }
  return out;
}

}  // namespace

ModelFolder::ModelFolder(const fs::path& model_file, std::size_t file_bytes) : file_bytes_(file_bytes) {
  std::error_code error;
  folder_ = fs::canonical(fs::absolute(model_file).parent_path(), error);
  if (error) throw InputError(model_file.string(), "there is no such folder");
}

bool ModelFolder::contains(const fs::path& canonical) const {
  return std::mismatch(folder_.begin(), folder_.end(), canonical.begin(), canonical.end()).first ==
         folder_.end();
}

Result<fs::path> ModelFolder::find(const fs::path& base, const std::string& url) const {
  if (url.empty() || url.size() > kMaxUrlBytes || has_control_bytes(url) ||
      has_control_bytes(percent_decoded(url)))
    return Failure{"that is not a file name"};
  if (url.find("://") != url.npos && url.rfind("file:", 0) != 0)
    return Failure{"only files beside the model are read"};
  std::string reason = "there is no such file";
  for (const std::string& spelling : spellings(url)) {
    std::error_code error;
    const fs::path file = fs::canonical(base / spelling, error);
    if (error) continue;
    if (!contains(file)) {
      reason = "it is outside the model's folder";
      continue;
    }
    if (fs::is_regular_file(file, error)) return file;
    reason = "it is not a regular file";
  }
  return Failure{std::move(reason)};
}

std::string ModelFolder::read(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    throw InputError(
        name(file), error || !fs::exists(file, error) ? "there is no such file" : "it is not a regular file");
  const auto size = fs::file_size(file, error);
  if (error) throw InputError(name(file), "its size cannot be read");
  if (size > file_bytes_)
    throw InputError(name(file),
                     "the file is larger than the limit of " + std::to_string(file_bytes_) + " bytes");
  std::ifstream in(file, std::ios::binary);
  std::string bytes(size, '\0');
  if (!in || (size > 0 && !in.read(bytes.data(), static_cast<std::streamsize>(size))))
    throw InputError(name(file), "the file cannot be read");
  note(file);
  if (bytes.size() >= 2 && bytes[0] == '\x1f' && bytes[1] == '\x8b')
    bytes = gunzip(bytes, file_bytes_, name(file));
  read_bytes_ += bytes.size();
  if (read_bytes_ > kMaxFiles * file_bytes_)
    throw InputError(name(file), "the model's files together are larger than the limit of " +
                                     std::to_string(kMaxFiles * file_bytes_) + " bytes");
  return bytes;
}

void ModelFolder::note(const fs::path& file) {
  if (noted_.insert(file.string()).second) files_.push_back(file);
}

std::string ModelFolder::name(const fs::path& file) const {
  const fs::path relative = file.lexically_relative(folder_);
  return relative.empty() || *relative.begin() == ".." ? file.filename().string() : relative.string();
}

std::string gunzip(const std::string& bytes, std::size_t limit, const std::string& file) {
  z_stream stream{};
  // 15 + 16: the largest window, gzip framing only.
  if (inflateInit2(&stream, 15 + 16) != Z_OK) throw InputError(file, "cannot be gunzipped");
  struct End {
    z_stream& stream;
    ~End() { inflateEnd(&stream); }
  } end{stream};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string out;
  std::string chunk(kChunkBytes, '\0');
  for (;;) {
    stream.next_out = reinterpret_cast<Bytef*>(chunk.data());
    stream.avail_out = static_cast<uInt>(chunk.size());
    const int status = inflate(&stream, Z_NO_FLUSH);
    out.append(chunk, 0, chunk.size() - stream.avail_out);
    if (out.size() > limit)
      throw InputError(file, "unpacks to more than the limit of " + std::to_string(limit) + " bytes");
    if (status == Z_STREAM_END) {
      // A gzip file may have several members, one after another; what follows the last one is padding.
      const bool has_member = stream.avail_in >= 2 && stream.next_in[0] == 0x1f && stream.next_in[1] == 0x8b;
      if (!has_member) return out;
      if (inflateReset(&stream) != Z_OK) throw InputError(file, "cannot be gunzipped");
      continue;
    }
    if (status != Z_OK || (stream.avail_in == 0 && stream.avail_out > 0))
      throw InputError(file, "the gzip data is truncated or corrupt");
  }
}

}  // namespace hilbrush
