// Computes the relations of bodies that expressions read (hil/world/relation.hpp), at the time of each step.
//
// Where a search is undecided, a distance is published if its bounds differ by at most 1 cm, a contact is
// false if the lower bound is above 0, and the output is unknown otherwise. Each is unknown before the first
// step. The instant of a crossing is unknown while the body is on the other side of the region's border than
// the last crossing that is final says.

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <hil/world/relation.hpp>
#include <hil/world/world_module.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/modules/region_crossings.hpp"
#include "runtime/modules/time_to_impact.hpp"

namespace hil::modules {
namespace {

using expression::Relation;
using expression::RelationKind;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t max_bodies_in_region = 1024;
/// The distance of a pair whose search was undecided is published if its bounds differ by at most this.
constexpr float max_bounds_apart_m = 0.01f;

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

glm::vec3 vec3_of(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

/// The region or beam of that name; empty with a mistake when there is none.
template <class Volume>
std::optional<Volume> volume_named(const config::Word& name, const std::vector<Volume>& volumes,
                                   const char* noun, config::Diagnostics& diagnostics) {
  std::vector<std::string> names;
  for (const Volume& volume : volumes) {
    if (volume.name.text == name.text) return volume;
    names.push_back(volume.name.text);
  }
  diagnostics.add(name.place, "there is no " + std::string(noun) + " " + config::in_quotes(name.text) +
                                  " in world." + noun + "s" + config::suggestion(name.text, names));
  return std::nullopt;
}

/// Two bodies, and their outputs; several relations may read one pair.
struct Pair {
  std::string first, second;
  std::vector<std::size_t> distances, contacts;
};
struct Impact {
  std::string first, second;
  rtstdb::Nanoseconds window{0};
  std::size_t output = 0;
  std::optional<TimeToImpact> time{};  ///< after configure
};
/// A body and a region, and their outputs.
struct BodyInRegion {
  std::string body;
  config::WorldRegion region;
  std::optional<std::size_t> inside{}, crossed_at{};
  std::optional<RegionCrossings> crossings{};  ///< after configure, where an output needs them
  bool is_member = false;                      ///< by the crossings that are final
  double crossed_at_s = unknown;               ///< the last of them
};
struct BodyInBeam {
  std::string body;
  config::WorldBeam beam;
  std::size_t output = 0;
};

class SpatialRelations final : public WorldModule {
 public:
  SpatialRelations(const Relations& relations, config::Diagnostics& diagnostics) {
    for (const Relation& relation : relations.all)
      add(relation, relations, diagnostics);
  }

  const WorldPorts& ports() const noexcept override { return ports_; }

  void configure(World& world, const Setup& setup) override {
    const TaskParameters& task = setup.task;
    database_ = &world.database();
    const std::string caller = "module " + task.instance;
    if (!pairs_.empty()) prepare_pairs(world, caller, task.instance);
    if (!impacts_.empty()) prepare_impacts(world, caller, task.instance + " impacts");
    for (Impact& impact : impacts_)
      impact.time.emplace(setup.events, impact.first + " and " + impact.second);
    if (!regions_.empty()) prepare_regions(world, caller, task.instance, setup.events);
    if (!beams_.empty()) prepare_beams(world, caller, task.instance);
    transaction_ = database_->make_transaction({.max_queries = 4});
  }

  void step(WorldStep& context) noexcept override {
    if (ports_.outputs.empty()) return;
    for (std::size_t i = 0; i < regions_.size(); ++i)
      if (regions_[i].crossings) take_crossings(context, regions_[i], bodies_in_regions_[i]);
    const rtstdb::WorldTime now = context.world_time();
    transaction_->begin({.deadline_class = context.read_class,
                         .deadline = context.deadline,
                         .importance = rtstdb::max_importance,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    if (contact_query_) {
      for (rtstdb::ContactSearch& search : contact_query_->searches())
        search.t = now;
      transaction_->add_query(*contact_query_, static_cast<std::uint32_t>(pairs_.size()));
    }
    if (impact_query_) {
      for (rtstdb::ImpactSearch& search : impact_query_->searches())
        search.t = now;
      transaction_->add_query(*impact_query_, static_cast<std::uint32_t>(impacts_.size()));
    }
    if (region_query_) {
      for (rtstdb::Region& region : region_query_->regions())
        region.t = now;
      transaction_->add_query(*region_query_, static_cast<std::uint32_t>(regions_.size()));
    }
    if (ray_query_) {
      for (rtstdb::Ray& ray : ray_query_->rays())
        ray.t = now;
      transaction_->add_query(*ray_query_, static_cast<std::uint32_t>(beams_.size()));
    }
    if (!context.execute(*database_, *transaction_).done()) return;
    take_pairs(context);
    take_impacts(context);
    take_regions(context);
    take_beams(context);
  }

 private:
  void add(const Relation& relation, const Relations& relations, config::Diagnostics& diagnostics) {
    const std::size_t output = ports_.outputs.size();
    ports_.outputs.push_back({.name = expression::relation_name(relation),
                              .unit = std::string(relation.function->unit),
                              .about = std::string(relation.function->about),
                              .initial = unknown});
    const std::string& first = relation.first.text;
    const std::string& second = relation.second.text;
    switch (relation.function->kind) {
      case RelationKind::distance:
        ports_.bodies.insert(ports_.bodies.end(), {relation.first, relation.second});
        pair_of(first, second).distances.push_back(output);
        return;
      case RelationKind::contact:
        ports_.bodies.insert(ports_.bodies.end(), {relation.first, relation.second});
        pair_of(first, second).contacts.push_back(output);
        return;
      case RelationKind::time_to_impact:
        ports_.bodies.insert(ports_.bodies.end(), {relation.first, relation.second});
        impacts_.push_back({.first = first,
                            .second = second,
                            .window = rtstdb::Nanoseconds(std::llround(relation.window_s * 1e9)),
                            .output = output});
        return;
      case RelationKind::inside:
      case RelationKind::crossed_at:
        ports_.bodies.push_back(relation.first);
        if (const auto region = volume_named(relation.second, relations.regions, "region", diagnostics)) {
          if (region->carrier) add_carrier(*region->carrier, relation.first, "region", diagnostics);
          BodyInRegion& body = body_in_region(first, *region);
          (relation.function->kind == RelationKind::inside ? body.inside : body.crossed_at) = output;
        }
        return;
      case RelationKind::sees:
        ports_.bodies.push_back(relation.second);
        if (const auto beam = volume_named(relation.first, relations.beams, "beam", diagnostics)) {
          if (beam->carrier) add_carrier(*beam->carrier, relation.second, "beam", diagnostics);
          beams_.push_back({.body = second, .beam = *beam, .output = output});
        }
        return;
    }
  }

  void add_carrier(const config::Word& carrier, const config::Word& body, const char* noun,
                   config::Diagnostics& diagnostics) {
    ports_.bodies.push_back(carrier);
    if (carrier.text != body.text) return;
    diagnostics.add(body.place, "'" + body.text + "' carries this " + noun +
                                    ", so the relation never changes; name another body");
  }

  Pair& pair_of(const std::string& first, const std::string& second) {
    for (Pair& pair : pairs_) {
      if ((pair.first == first && pair.second == second) || (pair.first == second && pair.second == first))
        return pair;
    }
    pairs_.push_back({.first = first, .second = second, .distances = {}, .contacts = {}});
    return pairs_.back();
  }

  BodyInRegion& body_in_region(const std::string& body, const config::WorldRegion& region) {
    for (BodyInRegion& known : regions_)
      if (known.body == body && known.region.name.text == region.name.text) return known;
    regions_.push_back({.body = body, .region = region});
    return regions_.back();
  }

  template <class Options>
  auto prepared(const Options& options, const std::string& caller) {
    auto query = database_->prepare(options);
    if (!query) throw RefusedByDatabase(caller, query.error());
    return std::move(query).value();
  }

  /// The queries count pairs of convex parts.
  static std::uint32_t candidates_of(const World& world, rtstdb::EntityId first, rtstdb::EntityId second) {
    return std::max(world.convex_parts_of(first) * world.convex_parts_of(second), 1U);
  }

  void prepare_pairs(World& world, const std::string& caller, const std::string& name) {
    std::uint32_t all_candidates = 0;
    std::vector<rtstdb::ContactSearch> searches;
    for (const Pair& pair : pairs_) {
      searches.push_back(
          {.first = world.entity_of(pair.first, caller), .second = world.entity_of(pair.second, caller)});
      all_candidates += candidates_of(world, searches.back().first, searches.back().second);
    }
    contact_query_ =
        prepared(rtstdb::ContactQueryOptions{.name = name,
                                             .capacity = static_cast<std::uint32_t>(searches.size()),
                                             .pairs_per_search = 1,
                                             .max_candidates = all_candidates},
                 caller);
    std::ranges::copy(searches, contact_query_->searches().begin());
  }

  void prepare_impacts(World& world, const std::string& caller, const std::string& name) {
    std::uint32_t max_candidates = 1;
    std::vector<rtstdb::ImpactSearch> searches;
    for (const Impact& impact : impacts_) {
      searches.push_back({.first = world.entity_of(impact.first, caller),
                          .second = world.entity_of(impact.second, caller),
                          .window = impact.window});
      max_candidates =
          std::max(max_candidates, candidates_of(world, searches.back().first, searches.back().second));
    }
    impact_query_ =
        prepared(rtstdb::ImpactQueryOptions{.name = name,
                                            .capacity = static_cast<std::uint32_t>(searches.size()),
                                            .candidates_per_search = max_candidates},
                 caller);
    std::ranges::copy(searches, impact_query_->searches().begin());
  }

  void prepare_regions(World& world, const std::string& caller, const std::string& name, EventLog& events) {
    region_query_ =
        prepared(rtstdb::RegionQueryOptions{.name = name,
                                            .capacity = static_cast<std::uint32_t>(regions_.size()),
                                            .ids_per_region = max_bodies_in_region},
                 caller);
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      const config::WorldRegion& from = regions_[i].region;
      rtstdb::Region& region = region_query_->regions()[i];
      region.shape = rtstdb::RegionShape::box;
      region.test = from.whole ? rtstdb::RegionTest::inside : rtstdb::RegionTest::touching;
      region.center_m = vec3_of(from.center_m);
      region.half_extent_m = 0.5f * vec3_of(from.size_m);
      region.q = glm::quat(glm::angleAxis(from.heading_rad, glm::dvec3(0.0, 0.0, 1.0)));
      if (from.carrier) region.carrier = world.entity_of(from.carrier->text, caller);
      bodies_in_regions_.push_back(world.entity_of(regions_[i].body, caller));
      if (regions_[i].crossed_at)
        regions_[i].crossings.emplace(*database_, region, "region " + from.name.text, caller, events);
    }
  }

  /// A beam on a carrier may begin inside it, so several hits are kept, of which those of the carrier do not
  /// count.
  void prepare_beams(World& world, const std::string& caller, const std::string& name) {
    ray_query_ = prepared(rtstdb::RayQueryOptions{.name = name,
                                                  .capacity = static_cast<std::uint32_t>(beams_.size()),
                                                  .mode = rtstdb::RayMode::first,
                                                  .hits_per_ray = rtstdb::max_hits_per_ray},
                          caller);
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      const config::WorldBeam& from = beams_[i].beam;
      rtstdb::Ray& ray = ray_query_->rays()[i];
      ray.origin_m = vec3_of(from.origin_m);
      ray.direction =
          glm::vec3(std::cos(from.elevation_rad) * std::cos(from.azimuth_rad),
                    std::cos(from.elevation_rad) * std::sin(from.azimuth_rad), std::sin(from.elevation_rad));
      ray.lambda_max = static_cast<float>(from.range_m);
      if (from.carrier) ray.carrier = world.entity_of(from.carrier->text, caller);
      seen_bodies_.push_back(world.entity_of(beams_[i].body, caller));
    }
  }

  void take_pairs(WorldStep& context) noexcept {
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const rtstdb::ContactAnswer& answer = std::as_const(*contact_query_).answers()[i];
      const bool is_answered = !answer.incomplete && !answer.overflow && answer.pairs.size() == 1;
      for (const std::size_t output : pairs_[i].distances)
        context.outputs[output] = is_answered ? distance_of(answer.pairs[0]) : unknown;
      for (const std::size_t output : pairs_[i].contacts)
        context.outputs[output] = is_answered ? contact_of(answer.pairs[0]) : unknown;
    }
  }

  void take_impacts(WorldStep& context) noexcept {
    for (std::size_t i = 0; i < impacts_.size(); ++i)
      context.outputs[impacts_[i].output] =
          impacts_[i].time->take(context, std::as_const(*impact_query_).answers()[i], impacts_[i].window);
  }

  static void take_crossings(const WorldStep& context, BodyInRegion& region, rtstdb::EntityId body) noexcept {
    region.crossings->take(context, [&](const rtstdb::StandingEvent& event) {
      if (event.kind == rtstdb::EventKind::reset) {
        region.is_member = false;
        region.crossed_at_s = unknown;
      }
      if (event.entity != body) return;
      region.is_member = event.kind != rtstdb::EventKind::exit;
      if (event.kind != rtstdb::EventKind::present)
        region.crossed_at_s = static_cast<double>(event.time.time_since_epoch().count()) * 1e-9;
    });
  }

  void take_regions(WorldStep& context) noexcept {
    for (std::size_t i = 0; i < regions_.size(); ++i) {
      const rtstdb::RegionAnswer& answer = std::as_const(*region_query_).answers()[i];
      bool is_inside = false;
      for (const rtstdb::EntityId& entity : answer.entities)
        is_inside |= entity == bodies_in_regions_[i];
      const bool is_known = is_inside || (!answer.overflow && !answer.incomplete);
      const BodyInRegion& region = regions_[i];
      if (region.inside) context.outputs[*region.inside] = !is_known ? unknown : is_inside ? 1.0 : 0.0;
      if (!region.crossed_at) continue;
      const bool is_final =
          region.crossings->is_complete(context) || (is_known && is_inside == region.is_member);
      context.outputs[*region.crossed_at] =
          is_final && region.crossings->is_known() ? region.crossed_at_s : unknown;
    }
  }

  void take_beams(WorldStep& context) noexcept {
    for (std::size_t i = 0; i < beams_.size(); ++i) {
      const rtstdb::EntityId carrier = ray_query_->rays()[i].carrier;
      const auto hits =
          std::as_const(*ray_query_).hits().subspan(i * rtstdb::max_hits_per_ray, rtstdb::max_hits_per_ray);
      const auto first = std::ranges::find_if(hits, [&](const rtstdb::RayHit& hit) {
        return hit.status != rtstdb::HitStatus::hit || hit.entity != carrier;
      });
      double& output = context.outputs[beams_[i].output];
      if (first == hits.end() || first->status == rtstdb::HitStatus::incomplete)
        output = unknown;
      else
        output = first->status == rtstdb::HitStatus::hit && first->entity == seen_bodies_[i] ? 1.0 : 0.0;
    }
  }

  std::vector<Pair> pairs_;
  std::vector<Impact> impacts_;
  std::vector<BodyInRegion> regions_;
  std::vector<BodyInBeam> beams_;
  WorldPorts ports_;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::ContactQuery> contact_query_;  // null, as the others: nothing to search
  std::unique_ptr<rtstdb::ImpactQuery> impact_query_;
  std::unique_ptr<rtstdb::RegionQuery> region_query_;
  std::unique_ptr<rtstdb::RayQuery> ray_query_;
  std::vector<rtstdb::EntityId> bodies_in_regions_, seen_bodies_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

}  // namespace

ModuleType spatial_relations_type() {
  return {.name = "spatial_relations",
          .about =
              "Computes the relations of bodies that expressions read, as distance(a, b). A scenario without "
              "a task of this type computes them at the end of each tick.",
          .parameters = config::Schema::record({}),
          .create = [](const config::Value& /*parameters*/, const TaskParameters& task,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            const std::size_t before = diagnostics.count();
            auto module = std::make_unique<SpatialRelations>(
                task.relations == nullptr ? Relations{} : *task.relations, diagnostics);
            if (diagnostics.count() != before) return nullptr;
            return module;
          },
          .computes = {"distance", "contact", "time_to_impact", "inside", "crossed_at", "sees"}};
}

}  // namespace hil::modules
