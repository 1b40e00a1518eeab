// Detector loops in the road: each step counts the bodies over each loop by a region query. A standing query
// finds those that enter and leave between two steps.
//
// Outputs  <loop>             bodies over the loop now
//          <loop>.entered_at  instant at which a body came over the loop last, s
//          <loop>.left_at     instant at which a body left it last, s
// An instant is unknown before there is one, while the loop has or lacks a body that no version has decided
// yet, and after crossings were lost.

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <hil/world/vector_parameter.hpp>
#include <hil/world/world_module.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/modules/region_crossings.hpp"

namespace hil::modules {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t max_bodies = 64;

struct Loop {
  std::string name;
  glm::dvec3 center_m{0.0};
  glm::dvec3 size_m{1.0};
  double heading_rad = 0.0;
};

/// What the crossings of a loop say, up to the version of a step.
class LoopRecord {
 public:
  LoopRecord() { bodies_.reserve(max_bodies); }

  void take(const rtstdb::StandingEvent& event) noexcept {
    switch (event.kind) {
      case rtstdb::EventKind::reset:
        bodies_.clear();
        more_bodies_ = 0;
        entered_at_s = left_at_s = unknown;
        return;
      case rtstdb::EventKind::present:
        return add(event.entity);
      case rtstdb::EventKind::enter:
        add(event.entity);
        ++entered;
        entered_at_s = seconds(event.time);
        return;
      case rtstdb::EventKind::exit:
        remove(event.entity);
        ++left;
        left_at_s = seconds(event.time);
        return;
      case rtstdb::EventKind::complete:
        return;
    }
  }
  /// Whether a body that is over the loop is none that has entered. True where that can not be told.
  bool lacks_one_of(const rtstdb::RegionAnswer& answer) const noexcept {
    return !is_comparable(answer) || std::ranges::any_of(answer.entities, [this](rtstdb::EntityId entity) {
      return std::ranges::find(bodies_, entity) == bodies_.end();
    });
  }
  /// Whether a body that has entered is no longer over the loop. True where that can not be told.
  bool has_more_than(const rtstdb::RegionAnswer& answer) const noexcept {
    return !is_comparable(answer) || std::ranges::any_of(bodies_, [&](rtstdb::EntityId entity) {
      return std::ranges::find(answer.entities, entity) == answer.entities.end();
    });
  }

  std::uint64_t entered = 0, left = 0;
  double entered_at_s = unknown, left_at_s = unknown;

 private:
  static double seconds(rtstdb::WorldTime time) noexcept {
    return static_cast<double>(time.time_since_epoch().count()) * 1e-9;
  }
  void add(rtstdb::EntityId entity) noexcept {
    if (bodies_.size() < max_bodies)
      bodies_.push_back(entity);
    else
      ++more_bodies_;
  }
  void remove(rtstdb::EntityId entity) noexcept {
    if (std::erase(bodies_, entity) == 0) --more_bodies_;
  }
  bool is_comparable(const rtstdb::RegionAnswer& answer) const noexcept {
    return more_bodies_ == 0 && !answer.overflow && !answer.incomplete;
  }

  std::vector<rtstdb::EntityId> bodies_;  ///< over the loop, at most max_bodies
  std::uint64_t more_bodies_ = 0;         ///< over the loop, which are not in the list
};

class Detectors final : public WorldModule {
 public:
  explicit Detectors(const config::Value& parameters) {
    for (const config::Value& layer : parameters["layers"].items()) {
      layers_.push_back(layer.text());
      ports_.layers.push_back({layer.text(), layer.place()});
    }
    ports_.searches.push_back({.layers = ports_.layers});
    for (const auto& [name, value] : parameters["loops"].entries()) {
      loops_.push_back(
          {name, vector_of(value["center"]), vector_of(value["size"]), value["heading"].number()});
      ports_.outputs.push_back({.name = name, .unit = "", .about = "Bodies over the loop now"});
    }
    for (const Loop& loop : loops_) {
      ports_.outputs.push_back({.name = loop.name + ".entered_at",
                                .unit = "s",
                                .about = "Instant at which a body came over the loop last",
                                .initial = unknown});
      ports_.outputs.push_back({.name = loop.name + ".left_at",
                                .unit = "s",
                                .about = "Instant at which a body left the loop last",
                                .initial = unknown});
    }
  }

  const WorldPorts& ports() const noexcept override { return ports_; }

  void configure(World& world, const Setup& setup) override {
    const TaskParameters& task = setup.task;
    database_ = &world.database();
    instance_ = task.instance;
    const std::string caller = "module " + task.instance;
    const std::uint32_t mask = world.mask_of(layers_, caller);
    auto query =
        database_->prepare(rtstdb::RegionQueryOptions{.name = task.instance,
                                                      .capacity = static_cast<std::uint32_t>(loops_.size()),
                                                      .ids_per_region = max_bodies});
    if (!query) throw RefusedByDatabase(caller, query.error());
    query_ = std::move(query).value();
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      rtstdb::Region& region = query_->regions()[i];
      region.shape = rtstdb::RegionShape::box;
      region.test = rtstdb::RegionTest::touching;
      region.center_m = glm::vec3(loops_[i].center_m);
      region.half_extent_m = glm::vec3(0.5 * loops_[i].size_m);
      region.q = glm::quat(glm::angleAxis(loops_[i].heading_rad, glm::dvec3(0.0, 0.0, 1.0)));
      region.mask = mask;
      crossings_.emplace_back(*database_, region, "loop " + loops_[i].name, caller, setup.events);
    }
    records_.resize(loops_.size());
    transaction_ = database_->make_transaction({.max_queries = 1});
  }

  void step(WorldStep& context) noexcept override {
    for (std::size_t i = 0; i < loops_.size(); ++i)
      crossings_[i].take(context, [&](const rtstdb::StandingEvent& event) { records_[i].take(event); });
    for (rtstdb::Region& region : query_->regions())
      region.t = context.world_time();
    transaction_->begin({.deadline_class = context.read_class,
                         .deadline = context.deadline,
                         .importance = rtstdb::max_importance - 1,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    transaction_->add_query(*query_, static_cast<std::uint32_t>(loops_.size()));
    if (!context.execute(*database_, *transaction_).done()) return;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      const rtstdb::RegionAnswer& answer = query_->answers()[i];
      context.outputs[i] = answer.found;
      const LoopRecord& record = records_[i];
      const bool is_complete = crossings_[i].is_complete(context);
      const bool is_known = crossings_[i].is_known();
      const std::span<double> instants = context.outputs.subspan(loops_.size() + 2 * i, 2);
      instants[0] = is_known && (is_complete || !record.lacks_one_of(answer)) ? record.entered_at_s : unknown;
      instants[1] = is_known && (is_complete || !record.has_more_than(answer)) ? record.left_at_s : unknown;
    }
  }

  void contribute(contribution::Contribution& report) const override {
    for (const Loop& loop : loops_) {
      const glm::dvec2 center(loop.center_m);
      const glm::dvec2 along =
          0.5 * loop.size_m.x * glm::dvec2(std::cos(loop.heading_rad), std::sin(loop.heading_rad));
      const glm::dvec2 across =
          0.5 * loop.size_m.y * glm::dvec2(-std::sin(loop.heading_rad), std::cos(loop.heading_rad));
      contribution::Shape shape{
          .layer = contribution::Layer::detector, .label = loop.name, .footprint = {}, .body_layer = {}};
      for (const glm::dvec2& p : {center + along + across, center - along + across, center - along - across,
                                  center + along - across}) {
        shape.footprint.push_back({p.x, p.y});
      }
      report.map.shapes.push_back(std::move(shape));
    }
    report.sections.push_back(counts_section());
  }

 private:
  contribution::Section counts_section() const {
    contribution::Section section{.name = instance_, .title = "Bodies over the loops of " + instance_};
    section.text =
        "Each body counts when it comes over a loop and when it leaves it, also between two runs of the "
        "task.";
    contribution::Table table;
    table.columns = {
        {.title = "loop"}, {.title = "entered", .numeric = true}, {.title = "left", .numeric = true}};
    for (std::size_t i = 0; i < loops_.size(); ++i)
      table.rows.push_back({{.text = loops_[i].name},
                            {.number = static_cast<double>(records_[i].entered)},
                            {.number = static_cast<double>(records_[i].left)}});
    section.tables.push_back(std::move(table));
    return section;
  }

  std::vector<Loop> loops_;
  std::vector<std::string> layers_;
  WorldPorts ports_;
  rtstdb::Database* database_ = nullptr;
  std::string instance_;
  std::unique_ptr<rtstdb::RegionQuery> query_;
  std::vector<RegionCrossings> crossings_;  ///< by loop, as the records
  std::vector<LoopRecord> records_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

}  // namespace

ModuleType detectors_type() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  const auto length = Schema::quantity(Quantity::length_m, -1e4, 1e4);
  const auto size = Schema::quantity(Quantity::length_m, 0.01, 1e3);
  const auto loop = Schema::record({
      Field::needed("center", Schema::list(length, 3, 3), "Centre of the loop's box."),
      Field::needed("size", Schema::list(size, 3, 3), "Full sizes of the loop's box before its rotation."),
      Field::with_default("heading", Schema::quantity(Quantity::angle_rad, -6.3, 6.3), "0 deg",
                          "Rotation about z."),
  });
  return {.name = "detectors",
          .about = "Detector loops in the road: the bodies over them, and when they came and left.",
          .parameters = Schema::record({
              Field::needed("layers", Schema::list(Schema::text(), 1, 32),
                            "Layers of the bodies that are counted."),
              Field::needed("loops", Schema::map(loop), "The loops by name, at least one."),
          }),
          .create = [](const config::Value& parameters, const TaskParameters& /*task*/,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            const std::size_t loops = parameters["loops"].entries().size();
            if (loops == 0 || loops > rtstdb::max_regions_per_query) {
              diagnostics.add(parameters["loops"].place(),
                              "'loops': " + std::to_string(loops) + " loops; from 1 to " +
                                  std::to_string(rtstdb::max_regions_per_query) + " are possible");
              return nullptr;
            }
            return std::make_unique<Detectors>(parameters);
          }};
}

}  // namespace hil::modules
