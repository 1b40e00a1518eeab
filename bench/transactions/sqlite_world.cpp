#include "bench/transactions/sqlite_world.hpp"

#include <sqlite3.h>

#include <algorithm>
#include <stdexcept>

namespace hil::bench {

void SqliteWorld::Closing::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

void SqliteWorld::Closing::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteWorld::~SqliteWorld() = default;

SqliteWorld::SqliteWorld(const std::filesystem::path& file, std::span<const rtstdb::Bounds> boxes) {
  std::filesystem::remove(file);
  sqlite3* opened = nullptr;
  const int code = sqlite3_open(file.c_str(), &opened);
  database_.reset(opened);
  demand(code);
  run("PRAGMA journal_mode=WAL");
  run("PRAGMA synchronous=NORMAL");
  run("CREATE VIRTUAL TABLE boxes USING rtree(number, x0, x1, y0, y1, z0, z1)");
  begin_ = prepare("BEGIN IMMEDIATE");
  commit_ = prepare("COMMIT");
  update_ = prepare("UPDATE boxes SET x0=?2, x1=?3, y0=?4, y1=?5, z0=?6, z1=?7 WHERE number=?1");
  select_ =
      prepare("SELECT number FROM boxes WHERE x1>=?1 AND x0<=?2 AND y1>=?3 AND y0<=?4 AND z1>=?5 AND z0<=?6");
  const Statement insert = prepare("INSERT INTO boxes VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)");
  run("BEGIN");
  for (std::size_t number = 0; number < boxes.size(); ++number) {
    demand(sqlite3_bind_int64(insert.get(), 1, static_cast<sqlite3_int64>(number)));
    bind(insert.get(), 2, boxes[number]);
    if (sqlite3_step(insert.get()) != SQLITE_DONE) demand(SQLITE_ERROR);
    demand(sqlite3_reset(insert.get()));
  }
  run("COMMIT");
}

void SqliteWorld::demand(int code) {
  if (code != SQLITE_OK) throw std::runtime_error(std::string("SQLite: ") + sqlite3_errmsg(database_.get()));
}

void SqliteWorld::run(const char* sql) {
  demand(sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr));
}

SqliteWorld::Statement SqliteWorld::prepare(const char* sql) {
  sqlite3_stmt* statement = nullptr;
  demand(sqlite3_prepare_v3(database_.get(), sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr));
  return Statement(statement);
}

void SqliteWorld::bind(sqlite3_stmt* statement, int first, const rtstdb::Bounds& box) {
  for (int axis = 0; axis < 3; ++axis) {
    demand(sqlite3_bind_double(statement, first + 2 * axis, static_cast<double>(box.minimum_m[axis])));
    demand(sqlite3_bind_double(statement, first + 2 * axis + 1, static_cast<double>(box.maximum_m[axis])));
  }
}

void SqliteWorld::move(std::span<const NumberedBox> moved) {
  const auto finish = [this](sqlite3_stmt* statement) {
    if (sqlite3_step(statement) != SQLITE_DONE) demand(SQLITE_ERROR);
    demand(sqlite3_reset(statement));
  };
  finish(begin_.get());
  for (const NumberedBox& one : moved) {
    demand(sqlite3_bind_int64(update_.get(), 1, one.number));
    bind(update_.get(), 2, one.box);
    finish(update_.get());
  }
  finish(commit_.get());
}

void SqliteWorld::touching(const rtstdb::Bounds& region, std::vector<std::uint32_t>& numbers) {
  numbers.clear();
  bind(select_.get(), 1, region);
  int code = SQLITE_ROW;
  while ((code = sqlite3_step(select_.get())) == SQLITE_ROW)
    numbers.push_back(static_cast<std::uint32_t>(sqlite3_column_int64(select_.get(), 0)));
  if (code != SQLITE_DONE) demand(code);
  demand(sqlite3_reset(select_.get()));
  std::ranges::sort(numbers);
}

std::string SqliteWorld::version() {
  return std::string("SQLite ") + sqlite3_libversion() + ", WAL, R*Tree";
}

}  // namespace hil::bench
