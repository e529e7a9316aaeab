// SQLite behind three small types. Faults of file or disk throw io::InputError with its name; others runtime_error.
#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace flappy::server {

class Statement {
 public:
  ~Statement();
  Statement(Statement&& other) noexcept;
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  template <class... Values>
  Statement& bind(const Values&... values) {
    int place = 0;
    (bind_one(++place, values), ...);
    return *this;
  }
  bool step();  ///< to the next row; false at the end
  void run();   ///< ignores rows

  std::int64_t integer(int column) const;
  double number(int column) const;
  std::string text(int column) const;
  bool is_null(int column) const;

 private:
  friend class Database;
  Statement(sqlite3* database, const std::string& name, std::string_view sql);
  void bind_one(int place, std::string_view text);
  void bind_one(int place, double number);
  template <std::integral T>
  void bind_one(int place, T value) {
    bind_integer(place, static_cast<std::int64_t>(value));
  }
  void bind_integer(int place, std::int64_t value);

  sqlite3* database_;
  std::string name_;
  sqlite3_stmt* statement_ = nullptr;
};

/// Only one thread at a time may use it.
class Database {
 public:
  /// Creates `file` where it is missing. A commit is durable: the write-ahead log is flushed with every commit.
  explicit Database(const std::filesystem::path& file);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  Statement prepare(std::string_view sql);
  /// Executes one or more statements without placeholders; ignores their rows.
  void run(const std::string& sql);
  std::uint64_t last_row() const;

 private:
  std::string name_;
  sqlite3* database_ = nullptr;
};

/// Rolls back in its destructor unless it was committed.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

}  // namespace flappy::server
