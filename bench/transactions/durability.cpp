#include "bench/transactions/durability.hpp"

#include <stdexcept>
#include <string>

#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/commit_load.hpp"
#include "bench/transactions/folder.hpp"

namespace hil::bench {
namespace {

constexpr rtstdb::Nanoseconds patience{60'000'000'000};

/// What is still in memory comes to the disk, so that the other side's round has the machine to itself. A commit that was not recorded
/// would make this side faster than it is.
void settle(rtstdb::Database& logged) {
  if (!logged.wait_until_durable(logged.latest().version, patience))
    throw std::runtime_error("the disk does not take the log: " + logged.durability().last_fault);
  if (logged.durability().commits_in_gaps != 0)
    throw std::runtime_error("the disk was too slow: commits were not recorded");
}

struct Size {
  std::uint32_t rows;
  int times, rounds;
  bool turns = false;
};

Figure async_beside_volatile(const std::string& name, const Size& size) {
  const Folder folder;
  CommitLoad without({.rows = size.rows, .turns = size.turns});
  CommitLoad logged({.rows = size.rows, .turns = size.turns, .durability = {.directory = folder.path()}});
  without.rate(size.times);
  logged.rate(size.times);
  settle(logged.database());
  logged.reopen();
  demand_same_world(without.database(), logged.database());

  std::vector<double> ours, theirs;
  const auto log_side = [&] {
    ours.push_back(logged.rate(size.times));
    settle(logged.database());
  };
  for (int round = 0; round < size.rounds; ++round) {
    if (round % 2 == 0) log_side();
    theirs.push_back(without.rate(size.times));
    if (round % 2 != 0) log_side();
  }
  Figure figure;
  figure.name = name;
  figure.ours = median(ours);
  figure.unit = "commit/s";
  figure.peer = "ours, volatile";
  figure.theirs = median(theirs);
  figure.better = Better::higher;
  figure.samples = static_cast<std::uint64_t>(size.rounds) * static_cast<std::uint64_t>(size.times);
  return figure;
}

}  // namespace

std::vector<Figure> measure_durability(const SuiteOptions& options) {
  // Bursts of a thousand rows are more than disks take: so many in one round that the ring holds them.
  const Size small = options.tiny ? Size{1, 400, 1} : Size{1, 20'000, 61};
  const Size large = options.tiny ? Size{1000, 2, 1} : Size{1000, 100, 121};
  Size turning = small;
  turning.turns = true;
  return {async_beside_volatile("durability_async_vs_volatile", small),
          async_beside_volatile("durability_async_vs_volatile_turning", turning),
          async_beside_volatile("durability_async_vs_volatile_1000_rows", large)};
}

}  // namespace hil::bench
