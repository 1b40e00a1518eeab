#include "bench/transactions/commits.hpp"

#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/commit_load.hpp"

namespace hil::bench {
namespace {

Figure commits(const std::string& name, const CommitLoadOptions& options, int times, int rounds) {
  CommitLoad load(options);
  load.rate(times);
  std::vector<double> rates;
  rates.reserve(static_cast<std::size_t>(rounds));
  for (int round = 0; round < rounds; ++round)
    rates.push_back(load.rate(times));
  Figure figure;
  figure.name = name;
  figure.ours = median(rates);
  figure.unit = "commit/s";
  figure.better = Better::higher;
  figure.samples =
      static_cast<std::uint64_t>(rounds) * static_cast<std::uint64_t>(times) * options.transactions;
  return figure;
}

}  // namespace

std::vector<Figure> measure_commits(const SuiteOptions& options) {
  const int rounds = options.tiny ? 1 : 9;
  const int share = options.tiny ? 100 : 1;
  return {commits("commits_one_row", {}, 20'000 / share, rounds),
          commits("commits_one_row_without_spin", {.spin = rtstdb::Nanoseconds(0)}, 20'000 / share, rounds),
          commits("commits_one_row_queued_64", {.transactions = 64}, 1'000 / share, rounds),
          commits("commits_1000_rows", {.rows = 1000}, 200 / share, rounds)};
}

}  // namespace hil::bench
