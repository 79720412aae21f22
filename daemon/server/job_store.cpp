#include "daemon/server/job_store.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <sqlite3.h>

#include <array>
#include <chrono>
#include <stdexcept>

namespace hilbrush {
namespace {

/// Step i brings a database from version i to i + 1. Steps are added, never changed.
constexpr std::array<const char*, 4> kMigrations{R"(
  CREATE TABLE job (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    key TEXT UNIQUE,
    uid INTEGER NOT NULL, gid INTEGER NOT NULL,
    state TEXT NOT NULL,
    model TEXT NOT NULL, model_copy TEXT NOT NULL, model_sha256 TEXT NOT NULL,
    settings TEXT NOT NULL, settings_sha256 TEXT NOT NULL, cell TEXT NOT NULL,
    dry_run INTEGER NOT NULL,
    created TEXT NOT NULL,
    placed INTEGER NOT NULL, skipped INTEGER NOT NULL, exposed INTEGER NOT NULL,
    planned_s REAL NOT NULL,
    error_at TEXT, error_message TEXT,
    warnings TEXT NOT NULL);
)",
                                                 // Jobs that have been painted on have a journal.
                                                 R"(
  ALTER TABLE job ADD COLUMN rank INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE job ADD COLUMN copies INTEGER NOT NULL DEFAULT 1;
  ALTER TABLE job ADD COLUMN copies_done INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE job ADD COLUMN is_begun INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE job ADD COLUMN started TEXT NOT NULL DEFAULT '';
  ALTER TABLE job ADD COLUMN ended TEXT NOT NULL DEFAULT '';
  ALTER TABLE job ADD COLUMN own_dots INTEGER NOT NULL DEFAULT 0;
  ALTER TABLE job ADD COLUMN own_median_s REAL NOT NULL DEFAULT 0;
  ALTER TABLE job ADD COLUMN own_p99_s REAL NOT NULL DEFAULT 0;
  UPDATE job SET rank = id, is_begun = (dry_run = 0 AND state IN ('painting', 'paused', 'done'));
  UPDATE job SET copies_done = 1 WHERE dry_run = 0 AND state = 'done';
  CREATE INDEX job_state ON job (state);
)",
                                                 // What moves took, as JSON.
                                                 R"(
  ALTER TABLE job ADD COLUMN measured TEXT NOT NULL DEFAULT '';
)",
                                                 // What the plan is, for the operator, as JSON.
                                                 R"(
  ALTER TABLE job ADD COLUMN plan_summary TEXT NOT NULL DEFAULT '';
)"};

constexpr const char* kColumns =
    "key, uid, gid, state, model, model_copy, model_sha256, settings, settings_sha256, cell, dry_run, "
    "created, placed, "
    "skipped, exposed, planned_s, error_at, error_message, warnings, rank, copies, copies_done, is_begun, "
    "started, "
    "ended, "
    "own_dots, own_median_s, own_p99_s, measured, plan_summary";
constexpr int kColumnCount = 30;

std::string marks() {
  std::string text = "?";
  for (int i = 1; i < kColumnCount; ++i) text += ", ?";
  return text;
}

/// The file holds no jobs that could be used: it may be set aside. All other faults, such as a full disk or
/// missing rights, leave it as it is.
struct DamagedStore : std::runtime_error {
  using std::runtime_error::runtime_error;
};

bool is_damage(const SQLite::Exception& error) {
  return error.getErrorCode() == SQLITE_CORRUPT || error.getErrorCode() == SQLITE_NOTADB;
}

void migrate(SQLite::Database& database) {
  const int version = database.execAndGet("PRAGMA user_version").getInt();
  if (version > static_cast<int>(kMigrations.size()))
    throw std::runtime_error("it was written by a newer hilbrushd (version " + std::to_string(version) + ")");
  for (auto step = static_cast<std::size_t>(version); step < kMigrations.size(); ++step) {
    SQLite::Transaction transaction(database);
    database.exec(kMigrations[step]);
    database.exec("PRAGMA user_version = " + std::to_string(step + 1));
    transaction.commit();
  }
}

std::unique_ptr<SQLite::Database> open_checked(const std::filesystem::path& file) {
  auto database =
      std::make_unique<SQLite::Database>(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE);
  database->setBusyTimeout(2000);
  if (const std::string answer = database->execAndGet("PRAGMA quick_check").getString(); answer != "ok")
    throw DamagedStore("it is damaged: " + answer);
  database->exec("PRAGMA journal_mode = WAL");
  // No sync a commit: the socket thread must not wait for a disk. What a power cut may take of a job's state,
  // its journal still knows.
  database->exec("PRAGMA synchronous = NORMAL");
  migrate(*database);
  return database;
}

void bind(SQLite::Statement& statement, const Job& job) {
  int i = 0;
  const auto text = [&](const std::string& value) { statement.bind(++i, value); };
  const auto number = [&](std::uint64_t value) { statement.bind(++i, static_cast<std::int64_t>(value)); };
  const auto text_or_null = [&](bool has_value, const std::string& value) {
    if (has_value)
      text(value);
    else
      statement.bind(++i);
  };
  text_or_null(!job.key.empty(), job.key);
  number(job.uid);
  number(job.gid);
  text(job_state_name(job.state));
  text(job.model.string());
  text(job.model_copy.string());
  text(job.model_sha256);
  text(job.settings);
  text(job.settings_sha256);
  text(job.cell);
  number(job.dry_run ? 1 : 0);
  text(job.created);
  number(job.placed);
  number(job.skipped);
  number(job.exposed);
  statement.bind(++i, job.planned_s);
  text_or_null(job.error.has_value(), job.error ? job.error->at : "");
  text_or_null(job.error.has_value(), job.error ? job.error->message : "");
  text(Json(job.warnings).dump(-1, ' ', false, Json::error_handler_t::replace));
  statement.bind(++i, job.rank);
  statement.bind(++i, job.copies);
  statement.bind(++i, job.copies_done);
  number(job.is_begun ? 1 : 0);
  text(job.started);
  text(job.ended);
  number(job.own_time.dots);
  statement.bind(++i, job.own_time.median_s);
  statement.bind(++i, job.own_time.p99_s);
  text(job.measured);
  text(job.plan);
}

Job read_job(SQLite::Statement& row) {
  Job job;
  int i = 0;
  const auto text = [&] { return row.getColumn(i++).getString(); };
  const auto number = [&] { return static_cast<std::uint64_t>(row.getColumn(i++).getInt64()); };
  job.id = row.getColumn(i++).getInt64();
  job.key = text();
  job.uid = static_cast<std::uint32_t>(number());
  job.gid = static_cast<std::uint32_t>(number());
  const std::string state = text();
  job.state = job_state_from_name(state).value_or(JobState::kFailed);
  job.model = text();
  job.model_copy = text();
  job.model_sha256 = text();
  job.settings = text();
  job.settings_sha256 = text();
  job.cell = text();
  job.dry_run = number() != 0;
  job.created = text();
  job.placed = number();
  job.skipped = number();
  job.exposed = number();
  job.planned_s = row.getColumn(i++).getDouble();
  if (!row.getColumn(i + 1).isNull())
    job.error = JobError{row.getColumn(i).getString(), row.getColumn(i + 1).getString()};
  i += 2;
  const Json warnings = Json::parse(text(), nullptr, false);
  if (warnings.is_array())
    for (const auto& warning : warnings)
      if (warning.is_string()) job.warnings.push_back(warning.get<std::string>());
  job.rank = row.getColumn(i++).getInt64();
  job.copies = row.getColumn(i++).getInt();
  job.copies_done = row.getColumn(i++).getInt();
  job.is_begun = number() != 0;
  job.started = text();
  job.ended = text();
  job.own_time.dots = number();
  job.own_time.median_s = row.getColumn(i++).getDouble();
  job.own_time.p99_s = row.getColumn(i++).getDouble();
  job.measured = text();
  job.plan = text();
  return job;
}

/// The database and what SQLite keeps beside it.
std::filesystem::path set_file_aside(const std::filesystem::path& file) {
  const auto seconds =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  const std::filesystem::path aside = file.string() + ".damaged-" + std::to_string(seconds);
  std::error_code ignored;
  for (const char* suffix : {"", "-wal", "-shm"})
    std::filesystem::rename(file.string() + suffix, aside.string() + suffix, ignored);
  return aside;
}

}  // namespace

struct JobStore::Implementation {
  std::unique_ptr<SQLite::Database> database;

  std::vector<Job> select(const std::string& condition) {
    std::vector<Job> jobs;
    SQLite::Statement rows(*database, std::string("SELECT id, ") + kColumns + " FROM job " + condition);
    while (rows.executeStep()) jobs.push_back(read_job(rows));
    return jobs;
  }
};

JobStore::JobStore(const std::filesystem::path& file) : implementation_(std::make_unique<Implementation>()) {
  is_new_ = !std::filesystem::exists(file);
  const auto set_aside = [&](const std::string& why) {
    const auto aside = set_file_aside(file);
    is_new_ = true;
    notice_ = file.string() + " cannot be used (" + why + "); it was set aside as " +
              aside.filename().string() + ", and the jobs are taken from the records in their folders";
  };
  const auto refuse = [&](const std::exception& error) {
    throw std::runtime_error(file.string() + ": the job store cannot be used: " + error.what());
  };
  try {
    implementation_->database = open_checked(file);
    return;
  } catch (const DamagedStore& error) {
    set_aside(error.what());
  } catch (const SQLite::Exception& error) {
    if (!is_damage(error)) refuse(error);
    set_aside(error.what());
  } catch (const std::exception& error) {
    refuse(error);
  }
  try {
    implementation_->database = open_checked(file);
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": no job store can be made: " + error.what());
  }
}

JobStore::~JobStore() = default;

void JobStore::insert(Job& job) {
  SQLite::Statement statement(*implementation_->database,
                              std::string("INSERT INTO job (") + kColumns + ") VALUES (" + marks() + ")");
  bind(statement, job);
  statement.exec();
  job.id = implementation_->database->getLastInsertRowid();
}

void JobStore::insert_with_id(const Job& job) {
  SQLite::Statement statement(*implementation_->database, std::string("INSERT OR IGNORE INTO job (") +
                                                              kColumns + ", id) VALUES (" + marks() + ", ?)");
  bind(statement, job);
  statement.bind(kColumnCount + 1, job.id);
  statement.exec();
}

void JobStore::update(const Job& job) {
  SQLite::Statement statement(*implementation_->database, std::string("UPDATE job SET (") + kColumns +
                                                              ") = (" + marks() + ") WHERE id = ?");
  bind(statement, job);
  statement.bind(kColumnCount + 1, job.id);
  statement.exec();
}

void JobStore::set_ranks(const std::vector<std::pair<std::int64_t, std::int64_t>>& job_ranks) {
  SQLite::Transaction transaction(*implementation_->database);
  SQLite::Statement statement(*implementation_->database, "UPDATE job SET rank = ? WHERE id = ?");
  for (const auto& [job, rank] : job_ranks) {
    statement.bind(1, rank);
    statement.bind(2, job);
    statement.exec();
    statement.reset();
  }
  transaction.commit();
}

std::vector<Job> JobStore::load_recent(std::size_t final_count) {
  const std::string is_final = "state IN ('done', 'failed', 'cancelled')";
  return implementation_->select("WHERE NOT " + is_final + " OR id IN (SELECT id FROM job WHERE " + is_final +
                                 " ORDER BY id DESC LIMIT " + std::to_string(final_count) + ") ORDER BY id");
}

std::optional<Job> JobStore::find(std::int64_t id) {
  auto found = implementation_->select("WHERE id = " + std::to_string(id));
  return found.empty() ? std::nullopt : std::optional<Job>(std::move(found.front()));
}

std::optional<Job> JobStore::find_key(const std::string& key) {
  SQLite::Statement row(*implementation_->database,
                        std::string("SELECT id, ") + kColumns + " FROM job WHERE key = ?");
  row.bind(1, key);
  if (!row.executeStep()) return std::nullopt;
  return read_job(row);
}

std::int64_t JobStore::last_rank() {
  return implementation_->database->execAndGet("SELECT COALESCE(MAX(rank), 0) FROM job").getInt64();
}

}  // namespace hilbrush
