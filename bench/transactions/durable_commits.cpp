#include "bench/transactions/durable_commits.hpp"

#include <string>

#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/commit_load.hpp"
#include "bench/transactions/folder.hpp"
#include "bench/transactions/plain_file.hpp"

namespace hil::bench {
namespace {

/// Large enough that neither side allocates space during the measurement.
constexpr std::uint64_t preallocated_bytes = std::uint64_t{16} << 20;

std::vector<Figure> commits_beside_writes(rtstdb::DurabilityMode mode, int count) {
  const Folder folder;
  CommitLoad load({.durability = {.directory = folder.path() / "log", .mode = mode}});
  PlainFile plain(folder.path() / "plain", preallocated_bytes);
  const std::uint64_t bytes_before = load.database().durability().bytes;
  load.once();
  const std::vector<std::byte> group(load.database().durability().bytes - bytes_before, std::byte{0x5a});

  RoundTimes times = in_turns(
      count, [&] { load.once(); }, [&] { plain.append(group); });
  if (load.database().durable() != load.database().latest().version)
    throw std::runtime_error("a commit was given back before it was durable");
  std::vector<Figure> figures;
  for (const auto& [suffix, share] : {std::pair{"p50", 0.5}, std::pair{"p99", 0.99}}) {
    Figure figure;
    figure.name = std::string("commit_latency_") + rtstdb::to_string(mode) + '_' + suffix;
    figure.ours = 1e6 * quantile(times.ours_s, share);
    figure.unit = "us";
    figure.peer = PlainFile::name;
    figure.theirs = 1e6 * quantile(times.theirs_s, share);
    figure.samples = times.ours_s.size();
    figures.push_back(figure);
  }
  return figures;
}

}  // namespace

std::vector<Figure> measure_durable_commits(const SuiteOptions& options) {
  const int count = options.tiny ? 20 : 2000;
  std::vector<Figure> figures = commits_beside_writes(rtstdb::DurabilityMode::group, count);
  for (Figure& figure : commits_beside_writes(rtstdb::DurabilityMode::sync, count))
    figures.push_back(std::move(figure));
  return figures;
}

}  // namespace hil::bench
