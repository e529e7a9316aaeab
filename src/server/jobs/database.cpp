#include "server/jobs/database.hpp"

#include <sqlite3.h>

#include <stdexcept>
#include <utility>

#include "io/files.hpp"

namespace flappy::server {
namespace {

[[noreturn]] void fail(sqlite3* database, const std::string& name) {
  const std::string what = database == nullptr ? "no memory" : sqlite3_errmsg(database);
  switch (database == nullptr ? SQLITE_NOMEM : sqlite3_errcode(database) & 0xff) {
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      throw io::InputError(name + ": is no sound queue: " + what + "; accepted: a queue that flappy-server left");
    case SQLITE_BUSY:  // another process holds its lock for too long
    case SQLITE_CANTOPEN:
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_PERM:
    case SQLITE_READONLY:
      throw io::InputError(name + ": cannot be written: " + what);
    default:
      throw std::runtime_error(name + ": " + what);
  }
}

}  // namespace

Statement::Statement(sqlite3* database, const std::string& name, std::string_view sql)
    : database_(database), name_(name) {
  if (sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement_, nullptr) != SQLITE_OK)
    fail(database, name);
}

Statement::Statement(Statement&& other) noexcept
    : database_(other.database_), name_(std::move(other.name_)), statement_(std::exchange(other.statement_, nullptr)) {}

Statement::~Statement() { sqlite3_finalize(statement_); }

bool Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code != SQLITE_ROW && code != SQLITE_DONE) fail(database_, name_);
  return code == SQLITE_ROW;
}

void Statement::run() {
  while (step()) continue;
}

void Statement::bind_one(int place, std::string_view text) {
  if (sqlite3_bind_text(statement_, place, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT) != SQLITE_OK)
    fail(database_, name_);
}

void Statement::bind_one(int place, double number) {
  if (sqlite3_bind_double(statement_, place, number) != SQLITE_OK) fail(database_, name_);
}

void Statement::bind_integer(int place, std::int64_t value) {
  if (sqlite3_bind_int64(statement_, place, value) != SQLITE_OK) fail(database_, name_);
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_, column); }
double Statement::number(int column) const { return sqlite3_column_double(statement_, column); }
bool Statement::is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

std::string Statement::text(int column) const {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return bytes == nullptr ? "" : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
}

Database::Database(const std::filesystem::path& file) : name_(file.string()) {
  try {
    if (sqlite3_open_v2(name_.c_str(), &database_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX,
                        nullptr) != SQLITE_OK)
      fail(database_, name_);
    sqlite3_busy_timeout(database_, 5000);  // wait for a person who looks at it with sqlite3
    run("PRAGMA journal_mode = WAL");
    run("PRAGMA synchronous = FULL");
    run("PRAGMA foreign_keys = ON");
  } catch (...) {
    sqlite3_close(database_);
    throw;
  }
}

Database::~Database() { sqlite3_close(database_); }

Statement Database::prepare(std::string_view sql) { return Statement(database_, name_, sql); }

void Database::run(const std::string& sql) {
  if (sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail(database_, name_);
}

std::uint64_t Database::last_row() const { return static_cast<std::uint64_t>(sqlite3_last_insert_rowid(database_)); }

Transaction::Transaction(Database& database) : database_(database) { database_.run("BEGIN IMMEDIATE"); }

Transaction::~Transaction() {
  if (!open_) return;
  try {
    database_.run("ROLLBACK");
  } catch (const std::exception&) {  // SQLite may have rolled back already, for example on a full disk
  }
}

void Transaction::commit() {
  database_.run("COMMIT");
  open_ = false;
}

}  // namespace flappy::server
