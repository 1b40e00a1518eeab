// Road vehicles on straight lanes. Each has a driver model (driver.hpp) that keeps the distance to the
// vehicle ahead on the lane and stops at the stop line while the light is not green, unless the vehicle
// runs its light. The device under test may brake a vehicle: the larger one of its deceleration and the
// driver's counts.
//
// Inputs   light_<group>  state of a traffic light: 0 red, 1 red-yellow, 2 green, 3 yellow
//          <vehicle>_brake_request  m/s2, at least 0; for vehicles with `braked_from_outside`
//          <vehicle>.desired_speed  m/s, of its driver on a free road; below 0.1 m/s it is 0.1 m/s
// Outputs  <vehicle>.x, .y (centre, m), .speed (m/s), .acceleration (m/s2), .yaw_rate (rad/s)
//
// The module writes the row of a vehicle only when its motion changes: between two writes the row is a
// function of time.

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <hil/world/world_module.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/modules/vehicles/car_shape.hpp"
#include "runtime/modules/vehicles/driver.hpp"

namespace hil::modules {
namespace {

constexpr double green_light = 2.0;
constexpr double min_desired_speed_mps = 0.1;
constexpr std::int64_t vehicle_track_every_ns = 50'000'000;
constexpr std::size_t max_vehicle_track_points = 1u << 16;
/// Integration steps in one step of the module. After skipped releases there is one for each period that
/// passed; beyond this number the steps are longer.
constexpr std::int64_t max_integration_steps = 64;
/// Vehicles with the same heading whose lanes are closer than this are on one lane.
constexpr double same_lane_m = 1.0;

struct Vehicle {
  std::string name;
  glm::dvec3 size_m{0.0};
  glm::dvec2 start_m{0.0};
  glm::dvec2 direction{1.0, 0.0};
  double heading_rad = 0.0;
  double max_deceleration_mps2 = 9.0;
  double brake_lag_s = 0.1;
  bool is_ego = false;
  bool braked_from_outside = false;
  bool runs_light = false;
  std::optional<double> stop_line_m;  ///< along the lane, from the start position's front edge
  std::string light;
  std::string layer;
  std::string material;  ///< empty: the default material
  std::string lamp;      ///< one of world.lights; empty: none
  DriverModel driver;

  std::optional<std::size_t> light_input, brake_input;
  std::size_t desired_speed_input = 0;
  std::size_t first_output = 0;
  rtstdb::EntityId entity;

  double travelled_m = 0.0;
  double speed_mps = 0.0;
  double acceleration_mps2 = 0.0;
  double brake_mps2 = 0.0;  ///< deceleration of the brake actuator
  double written_speed_mps = -1.0;
  bool was_braking = false;
  bool has_left = false;  ///< the region that the database permits: its row is not written any more
  EventLog::Kind leaves;
  std::vector<contribution::TrackPoint> track;

  glm::dvec2 center_m() const { return start_m + direction * travelled_m; }
};

class Vehicles final : public WorldModule {
 public:
  Vehicles(const config::Value& parameters, config::Diagnostics& diagnostics);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void step(WorldStep& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  void declare_ports();
  Ahead nearest_ahead(const Vehicle& vehicle, const WorldStep& context) const noexcept;
  double light_state(const Vehicle& vehicle, const WorldStep& context) const noexcept;
  void advance(Vehicle& vehicle, const WorldStep& context, double dt_s) noexcept;
  void watch_lights(const WorldStep& context) noexcept;
  void write_rows(WorldStep& context) noexcept;
  void write_outputs(WorldStep& context) noexcept;

  std::vector<Vehicle> vehicles_;
  WorldPorts ports_;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::int64_t simulated_until_ns_ = 0;         ///< run time
  rtstdb::Reservation* reservation_ = nullptr;  ///< of the world; null: refused
  EventLog::Kind braking_begins_, standing_;
  /// A light that vehicles obey, and its last state.
  struct Light {
    std::size_t input = 0;
    double shown = -1.0;
    EventLog::Kind turns[4];
  };
  std::vector<Light> lights_;
};

config::Schema vehicle_schema() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  const auto length = [](double low, double high) { return Schema::quantity(Quantity::length_m, low, high); };
  const auto acceleration = Schema::quantity(Quantity::acceleration_mps2, 0.1, 50.0);
  const auto speed = Schema::quantity(Quantity::speed_mps, 0.0, 100.0);
  return Schema::record({
      Field::with_default("size", Schema::list(length(0.1, 50.0), 3, 3), "[4.5 m, 1.8 m, 1.5 m]",
                          "Length, width and height of the vehicle."),
      Field::needed("position", Schema::list(length(-1e4, 1e4), 2, 2),
                    "Position of its centre at the start, x and y."),
      Field::with_default("heading", Schema::quantity(Quantity::angle_rad, -6.3, 6.3), "0 deg",
                          "Direction of travel, counted from +x to +y."),
      Field::needed("speed", speed, "Speed at the start."),
      Field::optional("desired_speed", Schema::quantity(Quantity::speed_mps, min_desired_speed_mps, 100.0),
                      "Speed that its driver keeps on a free road, the input NAME.desired_speed until a "
                      "signal or a stimulus drives it; default: the speed at the start."),
      Field::with_default("acceleration", acceleration, "1.5 m/s2", "Acceleration from rest."),
      Field::with_default("comfortable_deceleration", acceleration, "2.5 m/s2",
                          "Deceleration that its driver prefers."),
      Field::with_default("hardest_deceleration", acceleration, "9 m/s2",
                          "Maximum deceleration of its brakes."),
      Field::with_default("brake_lag", Schema::quantity(Quantity::duration_s, 0.0, 2.0), "100 ms",
                          "Time constant of the brake actuator for a brake request."),
      Field::optional("stop_line", length(0.0, 1e4),
                      "Distance from its front edge to its stop line at the start."),
      Field::optional("light", Schema::text(), "The light that it obeys: the module's input light_NAME."),
      Field::with_default("runs_light", Schema::boolean(), "false", "Whether it ignores that light."),
      Field::with_default("ego", Schema::boolean(), "false",
                          "Whether it is the ego, which the report draws on top."),
      Field::with_default("braked_from_outside", Schema::boolean(), "false",
                          "Whether it has the input NAME_brake_request."),
      Field::optional("layer", Schema::text(), "Its layer; default: the layer of the module."),
      Field::optional("material", Schema::name(),
                      "Its material, one of world.materials. Left out: matt, as of entities."),
      Field::optional("lamp", Schema::name(),
                      "The light that it carries, one of world.lights: a headlight. Left out: none."),
  });
}

Vehicles::Vehicles(const config::Value& parameters, config::Diagnostics& diagnostics) {
  const auto& entries = parameters["vehicles"].entries();
  for (const auto& [name, value] : entries) {
    Vehicle v;
    v.name = name;
    const auto& size = value["size"].items();
    v.size_m = {size[0].number(), size[1].number(), size[2].number()};
    v.start_m = {value["position"].items()[0].number(), value["position"].items()[1].number()};
    v.heading_rad = value["heading"].number();
    v.direction = {std::cos(v.heading_rad), std::sin(v.heading_rad)};
    v.speed_mps = value["speed"].number();
    v.driver.desired_speed_mps = value.has("desired_speed") ? value["desired_speed"].number() : v.speed_mps;
    v.driver.acceleration_mps2 = value["acceleration"].number();
    v.driver.comfortable_mps2 = value["comfortable_deceleration"].number();
    v.max_deceleration_mps2 = value["hardest_deceleration"].number();
    v.brake_lag_s = value["brake_lag"].number();
    if (value.has("stop_line")) v.stop_line_m = value["stop_line"].number();
    if (value.has("light")) v.light = value["light"].text();
    const config::Value& layer = value.has("layer") ? value["layer"] : parameters["layer"];
    v.layer = layer.text();
    ports_.layers_of_made.push_back({layer.text(), layer.place()});
    if (value.has("material")) {
      v.material = value["material"].text();
      ports_.materials.push_back({v.material, value["material"].place()});
    }
    ports_.makes.push_back(name);
    ports_.shapes.push_back(car_key(v.size_m));
    if (value.has("lamp")) {
      v.lamp = value["lamp"].text();
      ports_.lights.push_back({v.lamp, value["lamp"].place()});
    }
    v.runs_light = value["runs_light"].boolean();
    v.is_ego = value["ego"].boolean();
    v.braked_from_outside = value["braked_from_outside"].boolean();
    if (v.driver.desired_speed_mps <= 0.0) {
      diagnostics.add(value.place(), "vehicle '" + name + "' has speed 0 at the start and no desired_speed");
    }
    if (!v.light.empty() && !v.stop_line_m) {
      diagnostics.add(value["light"].place(), "vehicle '" + name + "' has a light but no stop_line");
    }
    vehicles_.push_back(std::move(v));
  }
  declare_ports();
}

void Vehicles::declare_ports() {
  const auto input = [&](Port port) {
    const auto known = std::find_if(ports_.inputs.begin(), ports_.inputs.end(),
                                    [&](const Port& p) { return p.name == port.name; });
    if (known != ports_.inputs.end()) return static_cast<std::size_t>(known - ports_.inputs.begin());
    ports_.inputs.push_back(std::move(port));
    return ports_.inputs.size() - 1;
  };
  for (Vehicle& v : vehicles_) {
    if (!v.light.empty()) {
      v.light_input = input(
          {.name = "light_" + v.light, .unit = "", .about = "State of light " + v.light, .required = true});
    }
    if (v.braked_from_outside) {
      v.brake_input = input({.name = v.name + "_brake_request",
                             .unit = "m/s2",
                             .about = "Deceleration that the device under test requests"});
    }
    v.desired_speed_input = input({.name = v.name + ".desired_speed",
                                   .unit = "m/s",
                                   .about = "Speed that its driver keeps on a free road",
                                   .initial = v.driver.desired_speed_mps});
    v.first_output = ports_.outputs.size();
    const glm::dvec2 at = v.center_m();
    ports_.outputs.push_back({.name = v.name + ".x", .unit = "m", .about = "Centre", .initial = at.x});
    ports_.outputs.push_back({.name = v.name + ".y", .unit = "m", .about = "Centre", .initial = at.y});
    ports_.outputs.push_back(
        {.name = v.name + ".speed", .unit = "m/s", .about = "Along its lane", .initial = v.speed_mps});
    ports_.outputs.push_back({.name = v.name + ".acceleration", .unit = "m/s2", .about = "Along its lane"});
    ports_.outputs.push_back({.name = v.name + ".yaw_rate", .unit = "rad/s", .about = "Lanes are straight"});
  }
}

rtstdb::Motion motion_of(const Vehicle& v, std::int64_t time_ns) {
  const glm::dvec2 at = v.center_m();
  return {.p_world_m = {at.x, at.y, 0.5 * v.size_m.z},
          .q_world = glm::angleAxis(v.heading_rad, glm::dvec3(0.0, 0.0, 1.0)),
          .v_world_mps = {v.direction.x * v.speed_mps, v.direction.y * v.speed_mps, 0.0},
          .w_world_radps = glm::dvec3(0.0),
          .valid_from = rtstdb::world_time_ns(time_ns)};
}

void Vehicles::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  database_ = &world.database();
  transaction_ = database_->make_transaction({.max_writes = static_cast<std::uint32_t>(vehicles_.size())});
  for (Vehicle& v : vehicles_) {
    rtstdb::EntityRow row;
    row.geometry = world.shared_geometry(car_key(v.size_m), [&] { return make_car(v.size_m); });
    const std::string caller = "module " + task.instance;
    row.mask = world.mask_of({v.layer}, caller);
    if (!v.lamp.empty()) row.light = world.light_of(v.lamp, caller);
    if (!v.material.empty()) row.material = world.material_of(v.material, caller);
    row.motion = motion_of(v, 0);
    v.entity = world.create(task.instance + "." + v.name, row);
    v.written_speed_mps = v.speed_mps;
    v.leaves = setup.events.add_kind(v.name + " leaves the world");
    v.track.reserve(max_vehicle_track_points);
  }
  // A transaction that writes rows takes microseconds. The budget leaves room for a loaded machine.
  const auto vehicles = static_cast<std::int64_t>(vehicles_.size());
  const rtstdb::Nanoseconds budget{100'000 + 2'000 * vehicles};
  const rtstdb::Nanoseconds deadline(task.deadline_ns);
  reservation_ = world.reserve({.name = task.instance,
                                .period = rtstdb::Nanoseconds(task.period_ns),
                                .deadline = deadline,
                                .budget = std::min(budget, deadline)});
  braking_begins_ = setup.events.add_kind("the device under test requests {} m/s2");
  standing_ = setup.events.add_kind("the ego stops, x = {} m", 2);
  constexpr const char* states[] = {"red", "red-yellow", "green", "yellow"};
  for (std::size_t i = 0; i < ports_.inputs.size(); ++i) {
    if (!ports_.inputs[i].required) continue;  // only lights are required
    Light light{.input = i, .turns = {}};
    for (std::size_t state = 0; state < 4; ++state) {
      light.turns[state] = setup.events.add_kind(ports_.inputs[i].name + " turns " + states[state]);
    }
    lights_.push_back(light);
  }
}

double Vehicles::light_state(const Vehicle& vehicle, const WorldStep& context) const noexcept {
  return vehicle.light_input ? context.inputs[*vehicle.light_input].value : green_light;
}

Ahead Vehicles::nearest_ahead(const Vehicle& vehicle, const WorldStep& context) const noexcept {
  Ahead ahead;
  for (const Vehicle& other : vehicles_) {
    if (&other == &vehicle || glm::dot(other.direction, vehicle.direction) < 0.99) continue;
    const glm::dvec2 between = other.center_m() - vehicle.center_m();
    const double along = glm::dot(between, vehicle.direction);
    const double across = between.x * vehicle.direction.y - between.y * vehicle.direction.x;
    if (along <= 0.0 || std::abs(across) > same_lane_m) continue;
    const double gap_m = along - 0.5 * (other.size_m.x + vehicle.size_m.x);
    if (gap_m < ahead.gap_m) ahead = {gap_m, other.speed_mps};
  }
  if (vehicle.stop_line_m && !vehicle.runs_light && light_state(vehicle, context) != green_light) {
    const double to_line_m = *vehicle.stop_line_m - vehicle.travelled_m;
    // A vehicle past the line, or too close to stop, drives on. The line counts as a leader's rear edge at
    // the standstill gap behind it.
    if (can_stop(vehicle.speed_mps, to_line_m + 0.5, vehicle.max_deceleration_mps2 * 0.6) &&
        to_line_m < ahead.gap_m) {
      ahead = {to_line_m + vehicle.driver.standstill_gap_m, 0.0};
    }
  }
  return ahead;
}

void Vehicles::advance(Vehicle& vehicle, const WorldStep& context, double dt_s) noexcept {
  vehicle.driver.desired_speed_mps =
      std::max(context.inputs[vehicle.desired_speed_input].value, min_desired_speed_mps);
  double acceleration = idm_acceleration(vehicle.driver, vehicle.speed_mps, nearest_ahead(vehicle, context),
                                         vehicle.max_deceleration_mps2);
  if (vehicle.brake_input) {
    const signals::SignalValue& request = context.inputs[*vehicle.brake_input];
    const double requested_mps2 =
        request.fresh ? std::clamp(request.value, 0.0, vehicle.max_deceleration_mps2) : 0.0;
    const double share = vehicle.brake_lag_s > 0.0 ? 1.0 - std::exp(-dt_s / vehicle.brake_lag_s) : 1.0;
    vehicle.brake_mps2 += (requested_mps2 - vehicle.brake_mps2) * share;
    if (requested_mps2 > 0.0 && !vehicle.was_braking)
      context.events->note(braking_begins_, context.time_ns, requested_mps2);
    vehicle.was_braking = requested_mps2 > 0.0;
    if (vehicle.brake_mps2 > 0.05) acceleration = std::min(acceleration, -vehicle.brake_mps2);
  }
  // A vehicle that brakes below this speed stops, since the driver model alone would never reach rest.
  const bool comes_to_rest = vehicle.speed_mps > 0.0 && vehicle.speed_mps < 0.05 && acceleration < 0.0;
  const Travel moved = comes_to_rest ? Travel{0.0, 0.0} : travel(vehicle.speed_mps, acceleration, dt_s);
  if (vehicle.is_ego && vehicle.speed_mps > 0.0 && moved.speed_mps == 0.0) {
    context.events->note(standing_, context.time_ns, vehicle.center_m().x);
  }
  vehicle.acceleration_mps2 = (moved.speed_mps - vehicle.speed_mps) / dt_s;
  vehicle.travelled_m += moved.distance_m;
  vehicle.speed_mps = moved.speed_mps;
}

void Vehicles::watch_lights(const WorldStep& context) noexcept {
  for (Light& light : lights_) {
    const signals::SignalValue& now = context.inputs[light.input];
    if (!now.fresh || now.value == light.shown) continue;
    light.shown = now.value;
    const auto state = static_cast<std::size_t>(std::clamp(now.value, 0.0, 3.0));
    context.events->note(light.turns[state], context.time_ns);
  }
}

void Vehicles::step(WorldStep& context) noexcept {
  watch_lights(context);
  // More than a period when releases were skipped: the simulation makes up for them.
  const std::int64_t passed_ns = context.time_ns - std::exchange(simulated_until_ns_, context.time_ns);
  if (passed_ns > 0) {
    const std::int64_t steps =
        std::clamp<std::int64_t>(passed_ns / context.period_ns, 1, max_integration_steps);
    const double dt_s = static_cast<double>(passed_ns) / static_cast<double>(steps) * 1e-9;
    for (std::int64_t step = 0; step < steps; ++step) {
      for (Vehicle& v : vehicles_)
        advance(v, context, dt_s);
    }
    write_rows(context);
  }
  write_outputs(context);
}

void Vehicles::write_rows(WorldStep& context) noexcept {
  transaction_->begin({.deadline_class = rtstdb::DeadlineClass::hard,
                       .deadline = context.deadline,
                       .importance = rtstdb::max_importance,
                       .world_time = context.world_time(),
                       .read_at = {},
                       .reservation = reservation_});
  bool any = false;
  for (Vehicle& v : vehicles_) {
    if (v.has_left) continue;
    const glm::dvec2 at = v.center_m();
    if (std::max(std::abs(at.x), std::abs(at.y)) > rtstdb::max_coordinate_m) {
      // The database would refuse the row, and with it the whole transaction.
      v.has_left = true;
      context.events->note(v.leaves, context.time_ns);
      continue;
    }
    // At constant speed the last written row still holds.
    if (v.speed_mps == v.written_speed_mps && v.acceleration_mps2 == 0.0) continue;
    transaction_->update_motion(v.entity, motion_of(v, context.time_ns));
    v.written_speed_mps = v.speed_mps;
    any = true;
  }
  if (!any || context.execute(*database_, *transaction_).done()) return;
  // No row was written: all have to be written again, also those of vehicles with constant speed.
  for (Vehicle& v : vehicles_)
    v.written_speed_mps = -1.0;
}

void Vehicles::write_outputs(WorldStep& context) noexcept {
  const bool track = context.time_ns % vehicle_track_every_ns == 0;
  for (Vehicle& v : vehicles_) {
    const glm::dvec2 at = v.center_m();
    context.outputs[v.first_output] = at.x;
    context.outputs[v.first_output + 1] = at.y;
    context.outputs[v.first_output + 2] = v.speed_mps;
    context.outputs[v.first_output + 3] = v.acceleration_mps2;
    if (track && v.track.size() < max_vehicle_track_points) v.track.push_back({context.time_ns, at.x, at.y});
  }
}

void Vehicles::contribute(contribution::Contribution& report) const {
  for (const Vehicle& v : vehicles_) {
    const glm::dvec2 at = v.center_m();
    const glm::dvec2 along = 0.5 * v.size_m.x * v.direction;
    const glm::dvec2 across = 0.5 * v.size_m.y * glm::dvec2(-v.direction.y, v.direction.x);
    contribution::Shape shape{.layer = v.is_ego ? contribution::Layer::ego : contribution::Layer::vehicle,
                              .label = v.name,
                              .footprint = {},
                              .body_layer = v.layer};
    for (const glm::dvec2& p :
         {at + along + across, at - along + across, at - along - across, at + along - across}) {
      shape.footprint.push_back({p.x, p.y});
    }
    report.map.shapes.push_back(std::move(shape));
    report.map.tracks.push_back({v.name, v.is_ego, v.track});
  }
}

}  // namespace

ModuleType vehicles_type() {
  using config::Field;
  using config::Schema;
  return {
      .name = "vehicles",
      .about = "Road vehicles on straight lanes.",
      .parameters = Schema::record({
          Field::with_default("layer", Schema::text(), "vehicle",
                              "The layer of the vehicles, one of world.layers when any are listed there."),
          Field::needed("vehicles", Schema::map(vehicle_schema()), "The vehicles by name."),
      }),
      .writes = true,
      .create = [](const config::Value& parameters, const TaskParameters& /*task*/,
                   config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
        return std::make_unique<Vehicles>(parameters, diagnostics);
      }};
}

}  // namespace hil::modules
