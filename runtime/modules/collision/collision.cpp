// Contacts of one body: each step queries the bodies whose oriented bounds overlap its own.
//
// Outputs  hits   bodies that overlap now
//          total  overlaps that began so far

#include <algorithm>

#include "runtime/modules/module.hpp"

namespace hil::modules {
namespace {

/// The bodies of one answer that are listed. Of further ones only the number is known.
constexpr std::uint32_t max_hits = 1024;

bool before(const rtstdb::EntityId& a, const rtstdb::EntityId& b) noexcept {
  return a.index != b.index ? a.index < b.index : a.generation < b.generation;
}

class Collision final : public Module {
 public:
  explicit Collision(const config::Value& parameters) : body_(parameters["body"].text()) {
    for (const config::Value& layer : parameters["against"].items()) {
      layers_.push_back(layer.text());
      ports_.layers.push_back({layer.text(), layer.place()});
    }
    ports_.bodies.push_back({body_, parameters["body"].place()});
    ports_.outputs = {{.name = "hits", .unit = "", .about = "Bodies touched now"},
                      {.name = "total", .unit = "", .about = "Bodies that began to touch so far"}};
  }

  const Ports& ports() const noexcept override { return ports_; }

  void configure(World& world, EventLog& events, const TaskParameters& task) override {
    const std::string caller = "module " + task.instance;
    entity_ = world.entity_of(body_, caller);
    mask_ = world.mask_of(layers_, caller);
    database_ = &world.database();
    auto query = database_->prepare(
        rtstdb::OverlapQueryOptions{.name = task.instance, .capacity = 1, .ids_per_entity = max_hits});
    if (!query) throw SetupError(caller, query.error());
    query_ = std::move(query).value();
    transaction_ = database_->make_transaction({.max_queries = 1});
    touching_.reserve(max_hits);
    touched_.reserve(max_hits);
    began_ = events.add_kind("COLLISION of " + body_ + " with {} bodies", 0);
    cut_ = events.add_kind("COLLISION of " + body_ + ": {} bodies touch it at once, more than the " +
                               std::to_string(max_hits) + " that are listed; 'total' is a lower bound",
                           0);
  }

  void step(StepContext& context) noexcept override {
    query_->overlaps()[0] = {.entity = entity_, .t = context.world_time(), .mask = mask_};
    transaction_->begin({.deadline_class = rtstdb::DeadlineClass::soft,
                         .deadline = context.deadline,
                         .importance = rtstdb::max_importance,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    transaction_->add_query(*query_, 1);
    if (!context.execute(*database_, *transaction_).done()) return;
    const rtstdb::OverlapAnswer& answer = query_->answers()[0];
    const double begun = begun_to_touch(answer);
    if (answer.found > max_hits && found_ <= max_hits)
      context.events->note(cut_, context.time_ns, answer.found);
    found_ = answer.found;
    context.outputs[0] = answer.found;
    context.outputs[1] += begun;
    if (begun > 0.0) context.events->note(began_, context.time_ns, begun);
  }

 private:
  /// The number of bodies that touch and did not touch at the last answer; a lower bound when the list of
  /// either answer is incomplete.
  double begun_to_touch(const rtstdb::OverlapAnswer& answer) noexcept {
    touched_.swap(touching_);
    touching_.assign(answer.entities.begin(), answer.entities.end());
    std::sort(touching_.begin(), touching_.end(), before);
    if (std::max(answer.found, found_) > max_hits)
      return answer.found > found_ ? static_cast<double>(answer.found - found_) : 0.0;
    return static_cast<double>(
        std::count_if(touching_.begin(), touching_.end(), [this](const rtstdb::EntityId& other) {
          return !std::binary_search(touched_.begin(), touched_.end(), other, before);
        }));
  }

  const std::string body_;
  std::vector<std::string> layers_;
  Ports ports_;
  rtstdb::Database* database_ = nullptr;
  rtstdb::EntityId entity_;
  std::uint32_t mask_ = 0;
  std::unique_ptr<rtstdb::OverlapQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::vector<rtstdb::EntityId> touching_, touched_;  // now, and at the answer before; sorted
  std::uint32_t found_ = 0;                           // at the answer before
  EventLog::Kind began_, cut_;
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
      }),
      .create = [](const config::Value& parameters, config::Diagnostics&) -> std::unique_ptr<Module> {
        return std::make_unique<Collision>(parameters);
      }};
}

}  // namespace hil::modules
