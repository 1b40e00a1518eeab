// exception: each request of the unit is answered with an exception.

#include "runtime/buses/modbus/modbus_fault.hpp"

namespace hil::buses::modbus {
namespace {

class ExceptionUnitFault final : public ModbusFault {
 public:
  explicit ExceptionUnitFault(std::uint8_t code) : code_(code) {}
  std::string sentence() const override { return "with replies of exception " + std::to_string(code_); }
  io::modbus::Interference interference() const override { return {.exception = code_}; }

 private:
  const std::uint8_t code_;
};

config::Schema exception_schema() {
  return config::Schema::integer(1, 11);
}

std::shared_ptr<const config::FaultEffect> read_exception(const config::Value& value,
                                                          const config::FaultContext& /*context*/) {
  return std::make_shared<const ExceptionUnitFault>(static_cast<std::uint8_t>(value.integer()));
}

}  // namespace

config::FaultKind exception_modbus_fault() {
  return {.target = config::FaultTarget::device,
          .key = "exception",
          .about = "Of a Modbus unit: the exception with which each request is answered.",
          .schema = exception_schema,
          .read = read_exception};
}

}  // namespace hil::buses::modbus
