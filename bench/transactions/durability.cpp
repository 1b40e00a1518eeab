#include "bench/transactions/durability.hpp"

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/commit_load.hpp"
#include "bench/transactions/folder.hpp"

namespace hil::bench {
namespace {

constexpr rtstdb::Nanoseconds patience{60'000'000'000};

/// Waits until everything is on disk, so that the other side's round has the machine to itself. A commit that
/// was not recorded would make this side look faster than it is.
void settle(rtstdb::Database& logged) {
  if (!logged.wait_until_durable(logged.latest().version, patience))
    throw std::runtime_error("the disk does not take the log: " + logged.durability().last_fault);
  if (logged.durability().commits_in_gaps != 0)
    throw std::runtime_error("the disk was too slow: commits were not recorded");
}

struct Size {
  std::uint32_t rows;
  int times, rounds, pairs;
  bool turns = false;
};

struct Rates {
  std::vector<double> logged, without;
};

/// Two databases at the same time, with the log in the one created first or second; equally many alternating
/// rounds of each.
void run_pair(const Size& size, bool logged_first, Rates& rates) {
  const Folder folder;
  std::optional<CommitLoad> logged, without;
  for (const bool has_log : {logged_first, !logged_first}) {
    CommitLoadOptions options{.rows = size.rows, .turns = size.turns};
    if (has_log) options.durability.directory = folder.path();
    (has_log ? logged : without).emplace(options).rate(size.times);
  }
  const auto log_side = [&] {
    rates.logged.push_back(logged->rate(size.times));
    settle(logged->database());
  };
  settle(logged->database());
  for (int round = 0; round < size.rounds; ++round) {
    if (round % 2 == 0) log_side();
    rates.without.push_back(without->rate(size.times));
    if (round % 2 != 0) log_side();
  }
  logged->reopen();
  demand_same_world(without->database(), logged->database());
}

/// Several pairs one after the other, since pairs differ by a few percent.
Figure async_beside_volatile(const std::string& name, const Size& size) {
  Rates rates;
  for (int pair = 0; pair < size.pairs; ++pair)
    run_pair(size, pair % 2 == 0, rates);
  Figure figure;
  figure.name = name;
  figure.ours = median(rates.logged);
  figure.unit = "commit/s";
  figure.peer = "ours, volatile";
  figure.theirs = median(rates.without);
  figure.better = Better::higher;
  figure.samples = rates.logged.size() * static_cast<std::uint64_t>(size.times);
  return figure;
}

}  // namespace

std::vector<Figure> measure_durability(const SuiteOptions& options) {
  // Disks are slower than bursts of a thousand rows: one round has as many as fit into the ring.
  const Size small = options.tiny ? Size{1, 400, 1, 1} : Size{1, 20'000, 16, 8};
  const Size large = options.tiny ? Size{1000, 2, 1, 1} : Size{1000, 100, 16, 8};
  Size turning = small;
  turning.turns = true;
  return {async_beside_volatile("durability_async_vs_volatile", small),
          async_beside_volatile("durability_async_vs_volatile_turning", turning),
          async_beside_volatile("durability_async_vs_volatile_1000_rows", large)};
}

}  // namespace hil::bench
