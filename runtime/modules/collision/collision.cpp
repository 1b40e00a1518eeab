// Contacts of one body: each step queries the bodies that touch it, by their oriented bounds or by the bodies
// themselves.
//
// Outputs  hits            bodies that touch now
//          total           contacts that began so far
//          depth           by: bodies; of the deepest contact now
//          time_to_impact  with an impact_window; see TimeToImpact

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <hil/world/world_module.hpp>

#include "runtime/modules/collision/touch_record.hpp"
#include "runtime/modules/collision/touching_bodies.hpp"
#include "runtime/modules/time_to_impact.hpp"

namespace hil::modules {
namespace {

/// The bodies of one answer that are listed. Of further ones only the number is known.
constexpr std::uint32_t max_hits = 1024;

bool before(const rtstdb::EntityId& a, const rtstdb::EntityId& b) noexcept {
  return a.index != b.index ? a.index < b.index : a.generation < b.generation;
}

class Collision final : public WorldModule {
 public:
  explicit Collision(const config::Value& parameters)
      : body_(parameters["body"].text()),
        by_bodies_(parameters["by"].text() == "bodies"),
        impact_window_(parameters["impact_window"].duration_ns()) {
    for (const config::Value& layer : parameters["against"].items()) {
      layers_.push_back(layer.text());
      ports_.layers.push_back({layer.text(), layer.place()});
    }
    ports_.bodies.push_back({body_, parameters["body"].place()});
    ports_.searches.push_back({.layers = ports_.layers, .without = ports_.bodies});
    ports_.outputs = {{.name = "hits", .unit = "", .about = "Bodies touched now"},
                      {.name = "total", .unit = "", .about = "Bodies that began to touch so far"}};
    if (by_bodies_)
      ports_.outputs.push_back({.name = "depth", .unit = "m", .about = "Of the deepest contact now"});
    if (impact_window_.count() > 0)
      ports_.outputs.push_back({.name = "time_to_impact",
                                .unit = "s",
                                .about = "Until the first impact; the window if there is none",
                                .initial = static_cast<double>(impact_window_.count()) * 1e-9});
  }

  const WorldPorts& ports() const noexcept override { return ports_; }

  void configure(World& world, const Setup& setup) override {
    const TaskParameters& task = setup.task;
    const std::string caller = "module " + task.instance;
    instance_ = task.instance;
    entity_ = world.entity_of(body_, caller);
    mask_ = world.mask_of(layers_, caller);
    database_ = &world.database();
    auto bodies = TouchingBodies::prepare(*database_, {.name = task.instance,
                                                       .entity = entity_,
                                                       .mask = mask_,
                                                       .max_hits = max_hits,
                                                       .by_bodies = by_bodies_,
                                                       .impact_window = impact_window_});
    if (!bodies) throw RefusedByDatabase(caller, bodies.error());
    bodies_ = std::move(bodies).value();
    if (by_bodies_) record_ = std::make_unique<TouchRecord>(world, setup.events, body_);
    if (impact_window_.count() > 0) time_to_impact_.emplace(setup.events, body_);
    transaction_ = database_->make_transaction({.max_queries = 2});
    touching_.reserve(max_hits);
    touched_.reserve(max_hits);
    began_ = setup.events.add_kind("COLLISION of " + body_ + " (bodies: {})", 0);
    cut_ = setup.events.add_kind("COLLISION of " + body_ + ": {} bodies touch it at once, more than the " +
                                     std::to_string(max_hits) + " that are listed; 'total' is a lower bound",
                                 0);
    lost_ = setup.events.add_kind(
        "COLLISION of " + body_ + ": more bodies, or pieces of them, are near it than the " +
            std::to_string(max_part_pairs) +
            " pairs that are searched; 'hits' is not known, nor 'total' from now on",
        0);
  }

  void step(WorldStep& context) noexcept override {
    transaction_->begin({.deadline_class = context.read_class,
                         .deadline = context.deadline,
                         .importance = rtstdb::max_importance,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    bodies_->add_to(*transaction_, context.world_time());
    if (!context.execute(*database_, *transaction_).done()) return;
    touched_.swap(touching_);
    touching_.clear();
    const Touching now = bodies_->take(touching_);
    if (time_to_impact_)
      context.outputs[3] = time_to_impact_->take(context, bodies_->first_impact(), impact_window_);
    if (!now.is_known) return lose_count(context);
    const double begun = begun_to_touch(now.found);
    if (now.found > max_hits && found_ <= max_hits) context.events->note(cut_, context.time_ns, now.found);
    found_ = now.found;
    context.outputs[0] = now.found;
    total_ += begun;
    context.outputs[1] = total_;
    if (by_bodies_) context.outputs[2] = now.depth_m;
    if (begun > 0.0) context.events->note(began_, context.time_ns, begun);
    if (begun > 0.0 && record_) record_new_touches(context);
  }

  void contribute(contribution::Contribution& report) const override {
    if (record_) record_->add_to(report, instance_);
  }

 private:
  /// The number of bodies that touch and did not touch at the last answer; a lower bound when the list of
  /// either answer is incomplete.
  double begun_to_touch(std::uint32_t found) noexcept {
    std::sort(touching_.begin(), touching_.end(), before);
    if (std::max(found, found_) > max_hits) return found > found_ ? static_cast<double>(found - found_) : 0.0;
    return static_cast<double>(std::count_if(
        touching_.begin(), touching_.end(), [this](const rtstdb::EntityId& other) { return is_new(other); }));
  }

  bool is_new(const rtstdb::EntityId& other) const noexcept {
    return !std::binary_search(touched_.begin(), touched_.end(), other, before);
  }

  void record_new_touches(WorldStep& context) noexcept {
    for (const rtstdb::EntityId& other : touching_) {
      if (!is_new(other)) continue;
      const rtstdb::ContactPair* pair = bodies_->pair_with(other);
      if (pair != nullptr) record_->note(context, *pair);
    }
  }

  /// Called when the touching bodies are not known. Contacts may begin unseen, so 'total' stays no number to
  /// the end of the run.
  void lose_count(WorldStep& context) noexcept {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    if (!std::isnan(total_)) context.events->note(lost_, context.time_ns);
    total_ = unknown;
    context.outputs[0] = context.outputs[1] = unknown;
    if (by_bodies_) context.outputs[2] = unknown;
  }

  const std::string body_;
  const bool by_bodies_;
  const rtstdb::Nanoseconds impact_window_;
  std::vector<std::string> layers_;
  WorldPorts ports_;
  rtstdb::Database* database_ = nullptr;
  rtstdb::EntityId entity_;
  std::uint32_t mask_ = 0;
  std::unique_ptr<TouchingBodies> bodies_;
  std::unique_ptr<TouchRecord> record_;         ///< by_bodies_
  std::optional<TimeToImpact> time_to_impact_;  ///< with an impact_window_
  std::string instance_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::vector<rtstdb::EntityId> touching_, touched_;  // now, and at the answer before; sorted
  std::uint32_t found_ = 0;                           // at the answer before
  double total_ = 0.0;
  EventLog::Kind began_, cut_, lost_;
};

}  // namespace

ModuleType collision_type() {
  using config::Field;
  using config::Schema;
  return {
      .name = "collision",
      .about = "Contacts of one body with others.",
      .parameters = Schema::record({
          Field::needed("body", Schema::text(),
                        "The body whose contacts are counted: 'module.vehicle' or the name of an entity."),
          Field::needed("against", Schema::list(Schema::text(), 1, 32),
                        "Layers of the bodies that it must not touch."),
          Field::with_default(
              "by", Schema::one_of({"bounds", "bodies"}), "bounds",
              "What touches: oriented bounds, or the bodies themselves. Two bodies that are convex, "
              "are solids or consist of convex pieces touch by these, other pairs by their triangles."),
          Field::with_default("impact_window", Schema::quantity(config::Quantity::duration_s, 0.0, 10.0),
                              "0 s",
                              "How far ahead the first impact is searched, for the output time_to_impact; 0 "
                              "without. Needs 'by: bodies'."),
      }),
      .create = [](const config::Value& parameters, const TaskParameters& /*task*/,
                   config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
        const config::Value& window = parameters["impact_window"];
        if (window.duration_ns() > 0 && parameters["by"].text() != "bodies") {
          diagnostics.add(window.place(), "'impact_window' needs 'by: bodies'");
          return nullptr;
        }
        return std::make_unique<Collision>(parameters);
      }};
}

}  // namespace hil::modules
