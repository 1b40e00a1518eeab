// Relations of named bodies in space, for conditions of stimuli, faults and expectations: how far two bodies
// are from one another, whether a body is in a region, whether a beam meets a body. At the time of each step.
//
// Outputs  PAIR.distance        m, between the surfaces; minus the depth when the bodies overlap
//          PAIR.contact         1 while the bodies touch
//          PAIR.time_to_impact  s, with a window; the window when there is no impact in it
//          REGION.inside        1 while the body is in the region
//          BEAM.sees            1 while the body is the first that the beam meets
// Where a search is undecided, the distance is published if its bounds differ by at most 1 cm, and contact is
// 0 if the lower bound is above 0; otherwise the output is unknown. Each is unknown before the first step.

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include <rtstdb/limits.hpp>

#include "runtime/modules/module.hpp"
#include "runtime/modules/vector_parameter.hpp"

namespace hil::modules {
namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t max_bodies_in_region = 1024;
/// The distance of a pair whose search was undecided is published if its bounds differ by at most this.
constexpr float max_bounds_apart_m = 0.01f;

struct Pair {
  std::string first, second;
  rtstdb::Nanoseconds window{0};
  std::size_t output = 0;  ///< the first of its outputs
};

struct BodyRegion {
  std::string body, carrier;  ///< carrier: may be empty
  glm::dvec3 center_m{0.0}, size_m{1.0};
  double heading_rad = 0.0;
  bool whole = false;
  std::size_t output = 0;
};

struct Beam {
  std::string body, carrier;
  glm::dvec3 origin_m{0.0};
  double azimuth_rad = 0.0, elevation_rad = 0.0, range_m = 0.0;
  std::size_t output = 0;
};

double distance_of(const rtstdb::ContactPair& pair) noexcept {
  const bool is_undecided = pair.status == rtstdb::PairStatus::undecided;
  if (is_undecided && !(pair.max_distance_m - pair.min_distance_m <= max_bounds_apart_m)) return unknown;
  return static_cast<double>(pair.distance_m);
}

double contact_of(const rtstdb::ContactPair& pair) noexcept {
  if (pair.status != rtstdb::PairStatus::undecided)
    return pair.status == rtstdb::PairStatus::contact ? 1.0 : 0.0;
  return pair.min_distance_m > 0.0f ? 0.0 : unknown;
}

class SpatialRelations final : public Module {
 public:
  explicit SpatialRelations(const config::Value& parameters) {
    for (const auto& [name, value] : parameters["pairs"].entries()) {
      pairs_.push_back({.first = body_of(value["first"]),
                        .second = body_of(value["second"]),
                        .window = rtstdb::Nanoseconds(value["impact_window"].duration_ns()),
                        .output = ports_.outputs.size()});
      add_output(name + ".distance", "m", "Between the two bodies");
      add_output(name + ".contact", "", "1 while the two bodies touch");
      if (pairs_.back().window.count() == 0) continue;
      ++impacts_count_;
      add_output(name + ".time_to_impact", "s", "Until the first impact; the window if there is none");
    }
    for (const auto& [name, value] : parameters["regions"].entries()) {
      regions_.push_back({.body = body_of(value["body"]),
                          .carrier = value.has("carrier") ? body_of(value["carrier"]) : std::string(),
                          .center_m = vector_of(value["center"]),
                          .size_m = vector_of(value["size"]),
                          .heading_rad = value["heading"].number(),
                          .whole = value["whole"].boolean(),
                          .output = ports_.outputs.size()});
      add_output(name + ".inside", "", "1 while the body is in the region");
    }
    for (const auto& [name, value] : parameters["beams"].entries()) {
      beams_.push_back({.body = body_of(value["body"]),
                        .carrier = value.has("carrier") ? body_of(value["carrier"]) : std::string(),
                        .origin_m = vector_of(value["origin"]),
                        .azimuth_rad = value["azimuth"].number(),
                        .elevation_rad = value["elevation"].number(),
                        .range_m = value["range"].number(),
                        .output = ports_.outputs.size()});
      add_output(name + ".sees", "", "1 while the body is the first that the beam meets");
    }
  }

  const Ports& ports() const noexcept override { return ports_; }

  void configure(World& world, EventLog& /*events*/, const TaskParameters& task) override {
    database_ = &world.database();
    const std::string caller = "module " + task.instance;
    if (!pairs_.empty()) prepare_pairs(world, caller, task.instance);
    if (!regions_.empty()) prepare_regions(world, caller, task.instance);
    if (!beams_.empty()) prepare_beams(world, caller, task.instance);
    transaction_ = database_->make_transaction({.max_queries = 4});
  }

  void step(StepContext& context) noexcept override {
    const rtstdb::WorldTime now = context.world_time();
    transaction_->begin({.deadline_class = rtstdb::DeadlineClass::soft,
                         .deadline = context.deadline,
                         .importance = rtstdb::max_importance,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    if (contacts_) {
      for (rtstdb::ContactSearch& search : contacts_->searches())
        search.t = now;
      transaction_->add_query(*contacts_, static_cast<std::uint32_t>(pairs_.size()));
    }
    if (impacts_) {
      for (rtstdb::ImpactSearch& search : impacts_->searches())
        search.t = now;
      transaction_->add_query(*impacts_, impacts_count_);
    }
    if (region_query_) {
      for (rtstdb::Region& region : region_query_->regions())
        region.t = now;
      transaction_->add_query(*region_query_, static_cast<std::uint32_t>(regions_.size()));
    }
    if (rays_) {
      for (rtstdb::Ray& ray : rays_->rays())
        ray.t = now;
      transaction_->add_query(*rays_, static_cast<std::uint32_t>(beams_.size()));
    }
    if (!context.execute(*database_, *transaction_).done()) return;
    take_pairs(context);
    take_regions(context);
    take_beams(context);
  }

 private:
  std::string body_of(const config::Value& value) {
    ports_.bodies.push_back({value.text(), value.place()});
    return value.text();
  }
  void add_output(std::string name, std::string unit, std::string about) {
    ports_.outputs.push_back(
        {.name = std::move(name), .unit = std::move(unit), .about = std::move(about), .initial = unknown});
  }

  template <class Options>
  auto prepared(const Options& options, const std::string& caller) {
    auto query = database_->prepare(options);
    if (!query) throw SetupError(caller, query.error());
    return std::move(query).value();
  }

  void prepare_pairs(World& world, const std::string& caller, const std::string& name) {
    std::uint32_t all_candidates = 0;  // the queries count pairs of convex parts
    std::uint32_t max_candidates = 1;
    std::vector<rtstdb::ContactSearch> contacts;
    std::vector<rtstdb::ImpactSearch> impacts;
    for (const Pair& pair : pairs_) {
      const rtstdb::EntityId first = world.entity_of(pair.first, caller);
      const rtstdb::EntityId second = world.entity_of(pair.second, caller);
      contacts.push_back({.first = first, .second = second});
      const std::uint32_t candidates =
          std::max(world.convex_parts_of(first) * world.convex_parts_of(second), 1U);
      all_candidates += candidates;
      if (pair.window.count() == 0) continue;
      impacts.push_back({.first = first, .second = second, .window = pair.window});
      max_candidates = std::max(max_candidates, candidates);
    }
    contacts_ = prepared(rtstdb::ContactQueryOptions{.name = name,
                                                     .capacity = static_cast<std::uint32_t>(contacts.size()),
                                                     .pairs_per_search = 1,
                                                     .max_candidates = all_candidates},
                         caller);
    std::ranges::copy(contacts, contacts_->searches().begin());
    if (impacts.empty()) return;
    impacts_ = prepared(
        rtstdb::ImpactQueryOptions{
            .name = name + " impacts", .capacity = impacts_count_, .candidates_per_search = max_candidates},
        caller);
    std::ranges::copy(impacts, impacts_->searches().begin());
  }

  void prepare_regions(World& world, const std::string& caller, const std::string& name) {
    region_query_ =
        prepared(rtstdb::RegionQueryOptions{.name = name,
                                            .capacity = static_cast<std::uint32_t>(regions_.size()),
                                            .ids_per_region = max_bodies_in_region},
                 caller);
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      const BodyRegion& from = regions_[i];
      rtstdb::Region& region = region_query_->regions()[i];
      region.shape = rtstdb::RegionShape::box;
      region.test = from.whole ? rtstdb::RegionTest::inside : rtstdb::RegionTest::touching;
      region.center_m = glm::vec3(from.center_m);
      region.half_extent_m = glm::vec3(0.5 * from.size_m);
      region.q = glm::quat(glm::angleAxis(from.heading_rad, glm::dvec3(0.0, 0.0, 1.0)));
      if (!from.carrier.empty()) region.carrier = world.entity_of(from.carrier, caller);
      bodies_in_regions_.push_back(world.entity_of(from.body, caller));
    }
  }

  void prepare_beams(World& world, const std::string& caller, const std::string& name) {
    rays_ = prepared(
        rtstdb::RayQueryOptions{.name = name, .capacity = static_cast<std::uint32_t>(beams_.size())}, caller);
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      const Beam& from = beams_[i];
      rtstdb::Ray& ray = rays_->rays()[i];
      ray.origin_m = glm::vec3(from.origin_m);
      ray.direction =
          glm::vec3(std::cos(from.elevation_rad) * std::cos(from.azimuth_rad),
                    std::cos(from.elevation_rad) * std::sin(from.azimuth_rad), std::sin(from.elevation_rad));
      ray.lambda_max = static_cast<float>(from.range_m);
      if (!from.carrier.empty()) ray.carrier = world.entity_of(from.carrier, caller);
      seen_bodies_.push_back(world.entity_of(from.body, caller));
    }
  }

  void take_pairs(StepContext& context) noexcept {
    std::size_t impact = 0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      double* const outputs = context.outputs.data() + pairs_[i].output;
      const rtstdb::ContactAnswer& answer = std::as_const(*contacts_).answers()[i];
      const bool is_answered = !answer.incomplete && !answer.overflow && answer.pairs.size() == 1;
      outputs[0] = is_answered ? distance_of(answer.pairs[0]) : unknown;
      outputs[1] = is_answered ? contact_of(answer.pairs[0]) : unknown;
      if (pairs_[i].window.count() == 0) continue;
      const rtstdb::ImpactAnswer& first = std::as_const(*impacts_).answers()[impact++];
      const bool is_decided =
          !first.incomplete && !first.overflow && first.status != rtstdb::ImpactStatus::undecided;
      const rtstdb::Nanoseconds until =
          first.status == rtstdb::ImpactStatus::impact ? first.after : pairs_[i].window;
      outputs[2] = is_decided ? static_cast<double>(until.count()) * 1e-9 : unknown;
    }
  }

  void take_regions(StepContext& context) noexcept {
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      const rtstdb::RegionAnswer& answer = std::as_const(*region_query_).answers()[i];
      bool is_inside = false;
      for (const rtstdb::EntityId& entity : answer.entities)
        is_inside |= entity == bodies_in_regions_[i];
      const bool is_known = is_inside || (!answer.overflow && !answer.incomplete);
      context.outputs[regions_[i].output] = !is_known ? unknown : is_inside ? 1.0 : 0.0;
    }
  }

  void take_beams(StepContext& context) noexcept {
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      const rtstdb::RayHit& hit = std::as_const(*rays_).hits()[i];
      const bool sees = hit.status == rtstdb::HitStatus::hit && hit.entity == seen_bodies_[i];
      context.outputs[beams_[i].output] = hit.status == rtstdb::HitStatus::incomplete ? unknown
                                          : sees                                      ? 1.0
                                                                                      : 0.0;
    }
  }

  std::vector<Pair> pairs_;
  std::vector<BodyRegion> regions_;
  std::vector<Beam> beams_;
  std::uint32_t impacts_count_ = 0;  ///< pairs with a window
  Ports ports_;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::ContactQuery> contacts_;  // null, as the others: nothing to search
  std::unique_ptr<rtstdb::ImpactQuery> impacts_;
  std::unique_ptr<rtstdb::RegionQuery> region_query_;
  std::unique_ptr<rtstdb::RayQuery> rays_;
  std::vector<rtstdb::EntityId> bodies_in_regions_, seen_bodies_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

}  // namespace

ModuleType spatial_relations_type() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  const auto length = Schema::quantity(Quantity::length_m, -1e5, 1e5);
  const auto size = Schema::quantity(Quantity::length_m, 0.001, 1e5);
  const auto angle = Schema::quantity(Quantity::angle_rad, -6.3, 6.3);
  const auto body = [](const char* name, const char* about) {
    return Field::needed(name, Schema::text(), about);
  };
  const Field carrier =
      Field::optional("carrier", Schema::text(),
                      "The body in whose frame the place is and with which it moves. Left out: the world.");
  const auto pair = Schema::record({
      body("first", "A body: 'module.vehicle' or the name of an entity."),
      body("second", "Another body."),
      Field::with_default("impact_window", Schema::quantity(Quantity::duration_s, 0.0, 10.0), "0 s",
                          "How far ahead the first impact is searched, for time_to_impact; 0: it is not."),
  });
  const auto region = Schema::record({
      body("body", "The body that is in the region or not."),
      Field::needed("center", Schema::list(length, 3, 3), "Centre of the region, which is a box."),
      Field::needed("size", Schema::list(size, 3, 3), "Full sizes of the box before its rotation."),
      Field::with_default("heading", angle, "0 deg", "Rotation of the box about z."),
      Field::with_default(
          "whole", Schema::boolean(), "false",
          "true: the body's oriented bounds lie in the region completely. false: a part of them does."),
      carrier,
  });
  const auto beam = Schema::record({
      body("body", "The body that the beam meets first or not."),
      Field::with_default("origin", Schema::list(length, 3, 3), "[0 m, 0 m, 0 m]",
                          "Where the beam begins; outside of its carrier's own body."),
      Field::with_default("azimuth", angle, "0 deg", "From x towards y."),
      Field::with_default("elevation", angle, "0 deg", "Up from the plane of x and y."),
      Field::needed("range", size, "The length of the beam."),
      carrier,
  });
  return {.name = "spatial_relations",
          .about = "Distances of bodies, bodies in regions and in beams, as signals for conditions.",
          .parameters = Schema::record({
              Field::with_default("pairs", Schema::map(pair), "{}", "Pairs of bodies by name."),
              Field::with_default("regions", Schema::map(region), "{}", "Regions by name."),
              Field::with_default("beams", Schema::map(beam), "{}", "Beams by name."),
          }),
          .create = [](const config::Value& parameters, const TaskParameters& /*task*/,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<Module> {
            std::map<std::string, const char*> kinds;
            std::size_t before = diagnostics.count();
            for (const char* const kind : {"pairs", "regions", "beams"}) {
              for (const auto& [name, value] : parameters[kind].entries()) {
                if (const auto [at, added] = kinds.try_emplace(name, kind); !added)
                  diagnostics.add(value.place(), "'" + name + "' is also one of the " + at->second);
              }
            }
            if (kinds.empty())
              diagnostics.add(parameters.place(), "needs one of 'pairs', 'regions' and 'beams'");
            for (const auto& [name, value] : parameters["pairs"].entries()) {
              if (value["first"].text() == value["second"].text())
                diagnostics.add(value["second"].place(),
                                "'" + value["second"].text() + "' is both bodies of the pair '" + name + "'");
            }
            if (diagnostics.count() != before) return nullptr;
            return std::make_unique<SpatialRelations>(parameters);
          }};
}

}  // namespace hil::modules
