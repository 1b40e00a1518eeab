#pragma once
// The peer: boxes in an R*Tree of SQLite, in a file, with a write-ahead log.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/geometry.hpp>

struct sqlite3;
struct sqlite3_stmt;

namespace hil::bench {

struct NumberedBox {
  std::uint32_t number = 0;
  rtstdb::Bounds box;
};

/// Every call throws std::runtime_error with SQLite's message when it fails.
class SqliteWorld {
 public:
  /// Creates the file. WAL with synchronous=NORMAL: a commit survives a crash of the program, but a loss of
  /// power only after a checkpoint.
  SqliteWorld(const std::filesystem::path& file, std::span<const rtstdb::Bounds> boxes);
  ~SqliteWorld();
  SqliteWorld(const SqliteWorld&) = delete;
  SqliteWorld& operator=(const SqliteWorld&) = delete;

  /// Moves all of them in one transaction.
  void move(std::span<const NumberedBox> moved);
  /// The indices of the boxes that touch this one, ascending.
  void touching(const rtstdb::Bounds& region, std::vector<std::uint32_t>& numbers);
  static std::string version();

 private:
  struct Closing {
    void operator()(sqlite3* database) const;
    void operator()(sqlite3_stmt* statement) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Closing>;

  void run(const char* sql);
  Statement prepare(const char* sql);
  void bind(sqlite3_stmt* statement, int first, const rtstdb::Bounds& box);
  void demand(int code);

  std::unique_ptr<sqlite3, Closing> database_;
  Statement begin_, commit_, update_, select_;
};

}  // namespace hil::bench
