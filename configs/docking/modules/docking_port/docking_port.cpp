// The docking port of a body. It measures where the port of another body, the chaser, is (port_geometry.hpp),
// and captures the chaser in the first step in which the chaser's port is within the capture limits. With a
// ring it captures only by contact: when the chaser's body begins to touch the ring (port_contact.hpp) and
// the chaser's port is within the limits. A touch that is not within them never captures, however slow the
// chaser becomes while it lasts. The chaser misses the port in the first step in which its port is farther
// behind the plane of this port than the capture limits permit.
//
// Outputs  distance, lateral (m), off_axis, misalignment (rad), closing_speed, lateral_speed (m/s): of the
//            chaser's port
//          docked  1 from the capture on; the input that holds the chaser (`hold` of a free_body,
//                  `<body>_hold` of rigid_bodies) may read it
//          missed  1 from the miss on
//          capture_lateral (m), capture_misalignment (rad), capture_speed (m/s): at the capture; 0 before
//          touches, touch_speed (m/s), undecided: with a ring; see PortContact

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/world/world_module.hpp>

#include "configs/docking/modules/docking.hpp"
#include "configs/docking/modules/docking_port/port_contact.hpp"
#include "configs/docking/modules/docking_port/port_geometry.hpp"
#include "configs/docking/modules/docking_port/port_parameter.hpp"

namespace hil::modules {
namespace {

struct CaptureLimits {
  double distance_m = 0.0;
  double lateral_m = 0.0;
  double misalignment_rad = 0.0;
  double closing_speed_mps = 0.0;
  double lateral_speed_mps = 0.0;

  bool permit(const RelativePort& port) const noexcept {
    return std::abs(port.distance_m) <= distance_m && port.lateral_m <= lateral_m &&
           port.misalignment_rad <= misalignment_rad &&
           std::abs(port.closing_speed_mps) <= closing_speed_mps &&
           port.lateral_speed_mps <= lateral_speed_mps;
  }
};

struct PortedBody {
  std::string name;
  BodyPort port;
  rtstdb::EntityId entity{};
};

/// A chaser that a step carries through the capture distance would not be captured.
void check_capture(const config::Value& capture, const TaskParameters& task,
                   config::Diagnostics& diagnostics) {
  const double step_m = capture["closing_speed"].number() * static_cast<double>(task.period_ns) * 1e-9;
  const double distance_m = capture["distance"].number();
  if (step_m < 2.0 * distance_m) return;
  diagnostics.add(capture.place(), "with its largest closing speed the chaser moves by up to " +
                                       config::format_number(1e3 * step_m) +
                                       " mm in a step of the task, and 'distance' is " +
                                       config::format_number(1e3 * distance_m) +
                                       " mm to either side: use a faster task or a larger distance");
}

class DockingPort final : public WorldModule {
 public:
  DockingPort(const config::Value& parameters, PortedBody target, PortedBody chaser);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void step(WorldStep& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  void judge(const RelativePort& measured, WorldStep& context) noexcept;
  /// Whether the port may capture in this step: without a ring always, else where a touch begins.
  bool may_capture(const RelativePort& measured, WorldStep& context) noexcept;
  /// What the limits apply to: with a ring the closing speed is that of the last touch.
  RelativePort at_touch(RelativePort port) const noexcept;

  PortedBody target_, chaser_;
  std::string ring_;  ///< a body; empty: the port has none
  std::unique_ptr<PortContact> contact_;
  CaptureLimits limits_;
  WorldPorts ports_;
  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  RelativePort at_capture_;
  double docked_ = 0.0, missed_ = 0.0;
  bool was_in_front_ = false;
  std::int64_t capture_ns_ = 0;
  EventLog::Kind captures_, misses_, uncaptured_touches_;
};

DockingPort::DockingPort(const config::Value& parameters, PortedBody target, PortedBody chaser)
    : target_(std::move(target)), chaser_(std::move(chaser)) {
  const config::Value& capture = parameters["capture"];
  limits_ = {.distance_m = capture["distance"].number(),
             .lateral_m = capture["lateral"].number(),
             .misalignment_rad = capture["misalignment"].number(),
             .closing_speed_mps = capture["closing_speed"].number(),
             .lateral_speed_mps = capture["lateral_speed"].number()};
  ports_.bodies = {{target_.name, parameters["target"]["body"].place()},
                   {chaser_.name, parameters["chaser"]["body"].place()}};
  ports_.outputs = {
      {.name = "distance", .unit = "m", .about = "To the chaser's port, along the axis of this port"},
      {.name = "lateral", .unit = "m", .about = "From the axis of this port to the chaser's port"},
      {.name = "off_axis",
       .unit = "rad",
       .about = "Angle between the axis and the line to the chaser's port"},
      {.name = "misalignment", .unit = "rad", .about = "Angle between the axes of both ports"},
      {.name = "closing_speed", .unit = "m/s", .about = "Of the chaser's port along the axis, inward"},
      {.name = "lateral_speed", .unit = "m/s", .about = "Of the chaser's port across the axis"},
      {.name = "docked", .unit = "", .about = "1: the port has captured the chaser"},
      {.name = "missed", .unit = "", .about = "1: the chaser came behind the port without being captured"},
      {.name = "capture_lateral", .unit = "m", .about = "`lateral` at the capture"},
      {.name = "capture_misalignment", .unit = "rad", .about = "`misalignment` at the capture"},
      {.name = "capture_speed", .unit = "m/s", .about = "`closing_speed` at the capture"}};
  if (!parameters.has("ring")) return;
  ring_ = parameters["ring"].text();
  ports_.bodies.push_back({ring_, parameters["ring"].place()});
  ports_.outputs.push_back({.name = "touches", .unit = "", .about = "Touches of the ring that began so far"});
  ports_.outputs.push_back(
      {.name = "touch_speed", .unit = "m/s", .about = "`closing_speed` when the last touch began"});
  ports_.outputs.push_back(
      {.name = "undecided", .unit = "", .about = "Steps so far in which a touch could not be decided"});
}

void DockingPort::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  const std::string caller = "module " + task.instance;
  target_.entity = world.entity_of(target_.name, caller);
  chaser_.entity = world.entity_of(chaser_.name, caller);
  database_ = &world.database();
  transaction_ = database_->make_transaction({.max_queries = ring_.empty() ? 0u : 1u, .max_reads = 2});
  if (!ring_.empty()) {
    auto contact =
        PortContact::prepare(*database_, task.instance, chaser_.entity, world.entity_of(ring_, caller));
    if (!contact) throw RefusedByDatabase(caller, contact.error());
    contact_ = std::move(contact).value();
  }
  captures_ = setup.events.add_kind(chaser_.name + " is captured at {} m/s", 3);
  misses_ = setup.events.add_kind(chaser_.name + " misses the port by {} m", 3);
  uncaptured_touches_ = setup.events.add_kind(
      chaser_.name + " touches " + ring_ + " at {} m/s and is not captured: it is not within the limits", 3);
}

void DockingPort::step(WorldStep& context) noexcept {
  transaction_->begin({.deadline_class = context.read_class,
                       .deadline = context.deadline,
                       .importance = rtstdb::max_importance,
                       .world_time = {},
                       .read_at = rtstdb::ReadAt::pinned(context.version)});
  transaction_->read(target_.entity);
  transaction_->read(chaser_.entity);
  if (contact_) contact_->add_to(*transaction_, context.world_time());
  if (!context.execute(*database_, *transaction_).done()) return;
  const rtstdb::EntityState* target = transaction_->state(0);
  const rtstdb::EntityState* chaser = transaction_->state(1);
  if (target == nullptr || chaser == nullptr) return;
  const RelativePort port =
      relative_port(chaser->row.motion, chaser_.port, target->row.motion, target_.port, context.world_time());
  judge(port, context);
  const std::array values{port.distance_m,
                          port.lateral_m,
                          port.off_axis_rad,
                          port.misalignment_rad,
                          port.closing_speed_mps,
                          port.lateral_speed_mps,
                          docked_,
                          missed_,
                          at_capture_.lateral_m,
                          at_capture_.misalignment_rad,
                          at_capture_.closing_speed_mps};
  std::copy(values.begin(), values.end(), context.outputs.begin());
  if (!contact_) return;
  const std::array contact{contact_->touches(), contact_->speed_mps(), contact_->undecided()};
  std::copy(contact.begin(), contact.end(), context.outputs.begin() + values.size());
}

bool DockingPort::may_capture(const RelativePort& measured, WorldStep& context) noexcept {
  if (!contact_) return true;
  if (!contact_->take(measured.closing_speed_mps)) return false;
  if (docked_ != 0.0 || limits_.permit(at_touch(measured))) return true;
  context.events->note(uncaptured_touches_, context.time_ns, contact_->speed_mps());
  return false;
}

RelativePort DockingPort::at_touch(RelativePort port) const noexcept {
  if (contact_) port.closing_speed_mps = contact_->speed_mps();
  return port;
}

void DockingPort::judge(const RelativePort& measured, WorldStep& context) noexcept {
  const bool is_capturing = may_capture(measured, context);
  if (docked_ != 0.0 || missed_ != 0.0) return;
  const RelativePort port = at_touch(measured);
  if (is_capturing && limits_.permit(port)) {
    docked_ = 1.0;
    at_capture_ = port;
    capture_ns_ = context.time_ns;
    context.events->note(captures_, context.time_ns, port.closing_speed_mps);
    return;
  }
  // So far behind the plane that a capture is no longer possible.
  if (was_in_front_ && port.distance_m < -limits_.distance_m) {
    missed_ = 1.0;
    context.events->note(misses_, context.time_ns, port.lateral_m);
  }
  was_in_front_ = was_in_front_ || port.distance_m > 0.0;
}

void DockingPort::contribute(contribution::Contribution& report) const {
  contribution::Section section{.name = "docking",
                                .title = "Docking of " + chaser_.name,
                                .text = docked_ != 0.0 ? "The port has captured the chaser."
                                        : missed_ != 0.0
                                            ? "The chaser came behind the port without being captured."
                                            : "The chaser was not captured.",
                                .pictures = {},
                                .tables = {}};
  if (docked_ != 0.0) {
    const auto column = [](const char* title, const char* unit, int decimals) {
      return contribution::Column{.title = title, .numeric = true, .unit = unit, .decimals = decimals};
    };
    constexpr double degrees = 57.29577951308232;
    section.tables.push_back(
        {.columns = {column("Run time of the capture", "s", 3), column("Closing speed", "mm/s", 1),
                     column("Lateral speed", "mm/s", 1), column("Lateral", "mm", 1),
                     column("Misalignment", "deg", 2)},
         .rows = {{{.number = static_cast<double>(capture_ns_) * 1e-9},
                   {.number = 1e3 * at_capture_.closing_speed_mps},
                   {.number = 1e3 * at_capture_.lateral_speed_mps},
                   {.number = 1e3 * at_capture_.lateral_m},
                   {.number = degrees * at_capture_.misalignment_rad}}}});
  }
  report.sections.push_back(std::move(section));
}

config::Schema docking_port_schema() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  const auto length = Schema::quantity(Quantity::length_m, 1e-6, 1e3);
  const auto speed = Schema::quantity(Quantity::speed_mps, 1e-6, 1e3);
  const auto port = Schema::record(port_fields());
  const auto capture = Schema::record({
      Field::with_default("distance", length, "20 mm", "Along the axis, to either side."),
      Field::with_default("lateral", length, "100 mm", "From the axis."),
      Field::with_default("misalignment", Schema::quantity(Quantity::angle_rad, 1e-6, 3.2), "4 deg",
                          "Between the axes."),
      Field::with_default("closing_speed", speed, "0.1 m/s", "Along the axis, in either direction."),
      Field::with_default("lateral_speed", speed, "0.04 m/s", "Across the axis."),
  });
  return Schema::record({
      Field::needed("target", port, "The body with this port."),
      Field::needed("chaser", port, "The body that is to dock, and its port."),
      Field::with_default("capture", capture, "{}",
                          "The port captures the chaser when no value is beyond its limit. With a step of "
                          "the task the chaser moves by closing speed times period, which has to be less "
                          "than twice the distance."),
      Field::optional(
          "ring", Schema::text(),
          "The body that the chaser has to touch to be captured, such as an entity with the shape "
          "of the port's ring."),
  });
}

}  // namespace

ModuleType docking_port_type() {
  return {.name = "docking_port",
          .about = "The docking port of a body: where another body's port is, and whether it is captured.",
          .parameters = docking_port_schema(),
          .create = [](const config::Value& parameters, const TaskParameters& task,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            const config::Value& target = parameters["target"];
            const config::Value& chaser = parameters["chaser"];
            const auto target_port = read_port(target, diagnostics);
            const auto chaser_port = read_port(chaser, diagnostics);
            if (!target_port || !chaser_port) return nullptr;
            const std::string& name = chaser["body"].text();
            if (target["body"].text() == name) {
              diagnostics.add(chaser["body"].place(), "'" + name + "' can not dock at itself");
              return nullptr;
            }
            check_capture(parameters["capture"], task, diagnostics);
            return std::make_unique<DockingPort>(
                parameters, PortedBody{.name = target["body"].text(), .port = *target_port},
                PortedBody{.name = name, .port = *chaser_port});
          }};
}

}  // namespace hil::modules
