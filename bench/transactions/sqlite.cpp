#include "bench/transactions/sqlite.hpp"

#include <algorithm>
#include <memory>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"
#include "bench/transactions/folder.hpp"
#include "bench/transactions/sqlite_world.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t ids_per_region = 256;
/// Rounding may decide whether boxes this near to touching do touch: single precision at 50 m, which SQLite
/// rounds outwards.
constexpr double touching_m = 4e-5;

rtstdb::Bounds bounds_of(const rtstdb::EntityRow& row) {
  const glm::dvec3 half_m = 0.5 * row.scale;
  return {glm::vec3(row.motion.p_world_m - half_m), glm::vec3(row.motion.p_world_m + half_m)};
}

std::vector<rtstdb::Bounds> bounds_of(const std::vector<rtstdb::EntityRow>& rows) {
  std::vector<rtstdb::Bounds> boxes;
  boxes.reserve(rows.size());
  for (const rtstdb::EntityRow& row : rows)
    boxes.push_back(bounds_of(row));
  return boxes;
}

/// The distance of two axis-aligned boxes; negative: their penetration depth.
double gap_m(const rtstdb::Bounds& a, const rtstdb::Bounds& b) {
  const glm::dvec3 gaps = glm::max(glm::dvec3(a.minimum_m) - glm::dvec3(b.maximum_m),
                                   glm::dvec3(b.minimum_m) - glm::dvec3(a.maximum_m));
  return std::max({gaps.x, gaps.y, gaps.z});
}

/// Amounts of work in a world of this many boxes.
struct Size {
  std::uint32_t entities, moved, regions;
  float half_m;
};

/// The work of both sides in one round: some boxes move in one transaction, then some regions are searched.
struct Round {
  std::vector<std::uint32_t> moved;
  std::vector<rtstdb::EntityRow> rows;
  std::vector<rtstdb::Bounds> regions;
};

class Workload {
 public:
  explicit Workload(const Size& size)
      : size_(size),
        world_(size.entities),
        rows_(boxes_of(strewn_boxes(size.entities, size.half_m, 40), world_)),
        peer_(folder_.path() / "world.sqlite", bounds_of(rows_)) {
    ids_ = world_.create(rows_);
    query_ = must(world_.database().prepare(rtstdb::RegionQueryOptions{
        .name = "regions", .capacity = size.regions, .ids_per_region = ids_per_region}));
    transaction_ = world_.database().make_transaction({.max_writes = size.moved, .max_queries = 1});
    theirs_.resize(size.regions);
  }

  Round next() {
    Round round;
    for (std::uint32_t k = 0; k < size_.moved; ++k) {
      const auto number = static_cast<std::uint32_t>(random_.next() % rows_.size());
      rows_[number].motion.p_world_m += glm::dvec3(random_.in_box(glm::vec3(0.1f)));
      round.moved.push_back(number);
      round.rows.push_back(rows_[number]);
    }
    for (std::uint32_t k = 0; k < size_.regions; ++k) {
      const glm::vec3 center = random_.in_box(glm::vec3(size_.half_m - 4.0f));
      const glm::vec3 half = glm::vec3(3.5f) + random_.in_box(glm::vec3(0.75f));
      round.regions.push_back({center - half, center + half});
    }
    return round;
  }

  void ours(const Round& round) {
    transaction_->begin({});
    for (std::size_t k = 0; k < round.moved.size(); ++k)
      transaction_->update_motion(ids_[round.moved[k]], round.rows[k].motion);
    for (std::size_t k = 0; k < round.regions.size(); ++k) {
      rtstdb::Region& region = query_->regions()[k];
      region.center_m = 0.5f * (round.regions[k].minimum_m + round.regions[k].maximum_m);
      region.half_extent_m = 0.5f * (round.regions[k].maximum_m - round.regions[k].minimum_m);
    }
    transaction_->add_query(*query_, size_.regions);
    const rtstdb::Outcome& outcome = world_.database().execute(*transaction_);
    if (outcome.status != rtstdb::Status::committed) throw std::runtime_error(rtstdb::describe(outcome));
  }

  void theirs(const Round& round) {
    moved_.clear();
    for (std::size_t k = 0; k < round.moved.size(); ++k)
      moved_.push_back({round.moved[k], bounds_of(round.rows[k])});
    peer_.move(moved_);
    for (std::size_t k = 0; k < round.regions.size(); ++k)
      peer_.touching(round.regions[k], theirs_[k]);
  }

  /// Throws unless both found the same in the last round.
  void demand_same(const Round& round) const {
    std::size_t found = 0;
    for (std::size_t k = 0; k < round.regions.size(); ++k) {
      std::vector<std::uint32_t> ours, different;
      for (const rtstdb::EntityId& id : query_->answers()[k].entities)
        ours.push_back(id.index);
      std::ranges::set_symmetric_difference(ours, theirs_[k], std::back_inserter(different));
      for (const std::uint32_t number : different) {
        if (std::abs(gap_m(bounds_of(rows_[number]), round.regions[k])) > touching_m)
          throw std::runtime_error("sqlite_update_region: SQLite answers otherwise for box " +
                                   std::to_string(number));
      }
      found += ours.size();
    }
    if (found < round.regions.size()) throw std::runtime_error("sqlite_update_region: nothing is found");
  }

 private:
  static std::vector<rtstdb::EntityRow> boxes_of(std::vector<rtstdb::EntityRow> rows, OurWorld& world) {
    const rtstdb::GeometryId box = world.add(rtstdb::make_box(glm::dvec3(1.0)));
    for (rtstdb::EntityRow& row : rows)
      row.geometry = box;
    return rows;
  }

  Size size_;
  OurWorld world_;
  Folder folder_;
  Random random_{41};
  std::vector<rtstdb::EntityRow> rows_;
  SqliteWorld peer_;
  std::vector<rtstdb::EntityId> ids_;
  std::unique_ptr<rtstdb::RegionQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::vector<NumberedBox> moved_;
  std::vector<std::vector<std::uint32_t>> theirs_;
};

Figure measure(const std::string& name, const Size& size, int rounds) {
  constexpr int warm_up = 10;
  Workload workload(size);
  std::vector<double> ours_s, theirs_s;
  for (int k = 0; k < rounds + warm_up; ++k) {
    const Round round = workload.next();
    const RoundTimes times = once_each(
        k % 2 == 0, [&] { workload.ours(round); }, [&] { workload.theirs(round); });
    workload.demand_same(round);
    if (k < warm_up) continue;
    ours_s.push_back(times.ours_s.front());
    theirs_s.push_back(times.theirs_s.front());
  }
  Figure figure;
  figure.name = name;
  figure.ours = 1.0 / median(ours_s);
  figure.unit = "round/s";
  figure.peer = SqliteWorld::version();
  figure.theirs = 1.0 / median(theirs_s);
  figure.better = Better::higher;
  figure.samples = ours_s.size();
  return figure;
}

}  // namespace

std::vector<Figure> measure_sqlite(const SuiteOptions& options) {
  const std::uint32_t share = options.tiny ? 10 : 1;
  const float half_m = options.tiny ? 11.0f : 23.0f;
  const int rounds = options.tiny ? 2 : 200;
  return {measure("sqlite_update_region", {10'000 / share, 1000 / share, 256 / share, half_m}, rounds),
          measure("sqlite_update_region_few", {10'000 / share, 10, 4, half_m}, 5 * rounds)};
}

}  // namespace hil::bench
