// Detector loops in the road: each step counts the bodies over each loop by a region query.
//
// Outputs  <loop>  bodies over the loop now

#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include <rtstdb/limits.hpp>

#include "runtime/modules/module.hpp"
#include "runtime/modules/vector_parameter.hpp"

namespace hil::modules {
namespace {

constexpr std::uint32_t max_bodies = 64;

struct Loop {
  std::string name;
  glm::dvec3 center_m{0.0};
  glm::dvec3 size_m{1.0};
  double heading_rad = 0.0;
};

class Detectors final : public Module {
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
  }

  const Ports& ports() const noexcept override { return ports_; }

  void configure(World& world, EventLog& /*events*/, const TaskParameters& task) override {
    database_ = &world.database();
    const std::uint32_t mask = world.mask_of(layers_, "module " + task.instance);
    auto query =
        database_->prepare(rtstdb::RegionQueryOptions{.name = task.instance,
                                                      .capacity = static_cast<std::uint32_t>(loops_.size()),
                                                      .ids_per_region = max_bodies});
    if (!query) throw SetupError("module " + task.instance, query.error());
    query_ = std::move(query).value();
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      rtstdb::Region& region = query_->regions()[i];
      region.shape = rtstdb::RegionShape::box;
      region.test = rtstdb::RegionTest::touching;
      region.center_m = glm::vec3(loops_[i].center_m);
      region.half_extent_m = glm::vec3(0.5 * loops_[i].size_m);
      region.q = glm::quat(glm::angleAxis(loops_[i].heading_rad, glm::dvec3(0.0, 0.0, 1.0)));
      region.mask = mask;
    }
    transaction_ = database_->make_transaction({.max_queries = 1});
  }

  void step(StepContext& context) noexcept override {
    for (rtstdb::Region& region : query_->regions())
      region.t = context.world_time();
    transaction_->begin({.deadline_class = context.read_class,
                         .deadline = context.deadline,
                         .importance = rtstdb::max_importance - 1,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    transaction_->add_query(*query_, static_cast<std::uint32_t>(loops_.size()));
    if (!context.execute(*database_, *transaction_).done()) return;
    for (std::size_t i = 0; i < loops_.size(); ++i)
      context.outputs[i] = query_->answers()[i].found;
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
  }

 private:
  std::vector<Loop> loops_;
  std::vector<std::string> layers_;
  Ports ports_;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::RegionQuery> query_;
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
          .about = "Detector loops in the road.",
          .parameters = Schema::record({
              Field::needed("layers", Schema::list(Schema::text(), 1, 32),
                            "Layers of the bodies that are counted."),
              Field::needed("loops", Schema::map(loop), "The loops by name, at least one."),
          }),
          .create = [](const config::Value& parameters, const TaskParameters& /*task*/,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<Module> {
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
