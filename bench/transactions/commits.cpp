#include "bench/transactions/commits.hpp"

#include <algorithm>
#include <memory>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t entity_count = 10'000;

/// A world whose entities are moved by transactions that are made beforehand.
class Commits {
 public:
  Commits(std::uint32_t transactions, std::uint32_t rows, rtstdb::Nanoseconds spin)
      : world_(entity_count, 16, spin), rows_(rows) {
    states_ = strewn_boxes(entity_count, 23.0f, 20);
    const rtstdb::GeometryId box = world_.add(rtstdb::make_box(glm::dvec3(1.0)));
    for (rtstdb::EntityRow& row : states_)
      row.geometry = box;
    ids_ = world_.create(states_);
    for (std::uint32_t k = 0; k < transactions; ++k)
      made_.push_back(world_.database().make_transaction({.max_writes = rows}));
  }

  /// Transactions a second: all of them submitted, then all waited for, so many times over.
  double rate(int times) {
    const double seconds = seconds_of([&] {
      for (int k = 0; k < times; ++k)
        once();
    });
    return static_cast<double>(made_.size()) * times / seconds;
  }

 private:
  void once() {
    for (const auto& transaction : made_) {
      transaction->begin({});
      for (std::uint32_t row = 0; row < rows_; ++row) {
        rtstdb::Motion& motion = states_[next_].motion;
        motion.p_world_m.x += 0.001;
        transaction->update_motion(ids_[next_], motion);
        next_ = (next_ + 1) % entity_count;
      }
      world_.database().submit(*transaction);
    }
    for (const auto& transaction : made_) {
      const rtstdb::Outcome& outcome = world_.database().wait(*transaction);
      if (outcome.status != rtstdb::Status::committed) throw std::runtime_error(rtstdb::describe(outcome));
    }
  }

  OurWorld world_;
  std::uint32_t rows_;
  std::vector<rtstdb::EntityRow> states_;
  std::vector<rtstdb::EntityId> ids_;
  std::vector<std::unique_ptr<rtstdb::Transaction>> made_;
  std::size_t next_ = 0;
};

Figure commits(const std::string& name, std::uint32_t transactions, std::uint32_t rows, int times, int rounds,
               rtstdb::Nanoseconds spin = rtstdb::DatabaseOptions{}.spin) {
  Commits bench(transactions, rows, spin);
  bench.rate(times);
  std::vector<double> rates;
  rates.reserve(static_cast<std::size_t>(rounds));
  for (int round = 0; round < rounds; ++round)
    rates.push_back(bench.rate(times));
  Figure figure;
  figure.name = name;
  figure.ours = median(rates);
  figure.unit = "commit/s";
  figure.better = Better::higher;
  figure.samples = static_cast<std::uint64_t>(rounds) * static_cast<std::uint64_t>(times) * transactions;
  return figure;
}

}  // namespace

std::vector<Figure> measure_commits(const SuiteOptions& options) {
  const int rounds = options.tiny ? 1 : 9;
  const int share = options.tiny ? 100 : 1;
  return {commits("commits_one_row", 1, 1, 20'000 / share, rounds),
          commits("commits_one_row_without_spin", 1, 1, 20'000 / share, rounds, rtstdb::Nanoseconds(0)),
          commits("commits_one_row_queued_64", 64, 1, 1'000 / share, rounds),
          commits("commits_1000_rows", 1, 1000, 200 / share, rounds)};
}

}  // namespace hil::bench
