#include <algorithm>
#include <utility>

#include <rtstdb/history.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/directory_error.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/log/version_range.hpp"
#include "rtstdb/open_history_range.hpp"

namespace rtstdb {
namespace {

Error no_log(const std::filesystem::path& directory) {
  return {ErrorCode::file, directory.string() + ": there is no log of a database"};
}

/// Sets the capacities of the options to what the range needs.
Result<void> set_capacities(DatabaseOptions& options, log::VersionRange& range) {
  std::uint64_t changes = 1;
  std::size_t entities = std::max<std::size_t>(range.begin.rows.size(), 1);
  std::vector<std::uint64_t> shapes(range.begin.geometries.size(), 1);
  for (const log::OwnedCommit& commit : range.commits) {
    changes += std::max<std::size_t>(commit.set().writes.size(), 1);
    for (const store::Write& write : commit.set().writes)
      entities = std::max<std::size_t>(entities, write.state.id.index + std::size_t{1});
    for (const store::ShapeWrite& shape : commit.set().shapes)
      ++shapes[shape.geometry.index];
  }
  const auto refuse = [](const std::string& what, std::uint64_t count, std::uint64_t limit) {
    return Error{ErrorCode::capacity, "the range has " + std::to_string(count) + " " + what +
                                          ", and a database keeps " + std::to_string(limit) +
                                          "; take a shorter one"};
  };
  if (changes > max_retained_changes) return refuse("changes of rows", changes, max_retained_changes);
  for (std::size_t index = 0; index < shapes.size(); ++index) {
    log::LoggedGeometry& geometry = range.begin.geometries[index].logged;
    if (!geometry.options.deforms) continue;
    if (shapes[index] > max_retained_shapes)
      return refuse("shapes of geometry '" + geometry.name + "'", shapes[index], max_retained_shapes);
    geometry.options.retained_shapes = static_cast<std::uint32_t>(shapes[index]);
  }
  options.max_entities = static_cast<std::uint32_t>(entities);
  options.max_geometries = static_cast<std::uint32_t>(std::max<std::size_t>(shapes.size(), 1));
  options.retained_changes = static_cast<std::uint32_t>(changes);
  return {};
}

}  // namespace

Result<HistoryExtent> history_extent(const std::filesystem::path& directory, bool salvage) {
  auto disk = log::open_existing_directory(directory);
  if (!disk) return with_directory(directory, {ErrorCode::file, disk.error().describe()});
  try {
    auto extent = log::read_extent(*disk.value(), salvage);
    if (!extent) return with_directory(directory, extent.error());
    const log::Extent& found = extent.value();
    if (found.database_id == 0) return no_log(directory);
    HistoryExtent extent_result{.database_id = found.database_id,
                                .first = found.first,
                                .last = found.last,
                                .commits = found.commits,
                                .gaps = {},
                                .closed = found.end == log::LogEnd::closed,
                                .damage = found.damage};
    for (const log::Gap& gap : found.gaps)
      extent_result.gaps.push_back({gap.first, gap.last});
    return extent_result;
  } catch (const std::bad_alloc&) {
    return with_directory(directory, {ErrorCode::out_of_memory, "the log does not fit into memory"});
  }
}

Result<std::unique_ptr<Database>> open_history(const HistoryOptions& options) {
  auto disk = log::open_existing_directory(options.directory);
  if (!disk) return with_directory(options.directory, {ErrorCode::file, disk.error().describe()});
  try {
    auto range = log::read_version_range(*disk.value(), options.from, options.to, options.salvage);
    if (!range) return with_directory(options.directory, range.error());
    DatabaseOptions database;
    database.gpu = options.gpu;
    database.validation = options.validation;
    if (auto space = set_capacities(database, range.value()); !space)
      return with_directory(options.directory, space.error());
    return open_history_range(database, std::move(range).value());
  } catch (const std::bad_alloc&) {
    return with_directory(options.directory,
                          {ErrorCode::out_of_memory, "the range does not fit into memory"});
  }
}

}  // namespace rtstdb
