// delay: each reply of the unit comes later.

#include <chrono>

#include <hil/quantity.hpp>

#include "runtime/buses/modbus/modbus_fault.hpp"
#include "runtime/config/shared_schemas.hpp"

namespace hil::buses::modbus {
namespace {

class DelayedUnitFault final : public ModbusFault {
 public:
  explicit DelayedUnitFault(std::int64_t delay_ns) : delay_ns_(delay_ns) {}
  std::string sentence() const override {
    return "with replies delayed by " + config::format_duration(delay_ns_);
  }
  io::modbus::Interference interference() const override {
    return {.delay = std::chrono::nanoseconds(delay_ns_)};
  }

 private:
  const std::int64_t delay_ns_;
};

config::Schema delay_schema() {
  return config::duration_schema(config::min_duration_s, config::max_fault_delay_s);
}

std::shared_ptr<const config::FaultEffect> read_delay(const config::Value& value,
                                                      const config::FaultContext& /*context*/) {
  return std::make_shared<const DelayedUnitFault>(value.duration_ns());
}

}  // namespace

config::FaultKind delay_modbus_fault() {
  return {.target = config::FaultTarget::device,
          .key = "delay",
          .about = "a reply of a Modbus unit",
          .schema = delay_schema,
          .read = read_delay};
}

}  // namespace hil::buses::modbus
