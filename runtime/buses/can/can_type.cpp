// The type of bus `can`.

#include <linux/can.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "runtime/buses/bus.hpp"
#include "runtime/buses/can/can_description.hpp"
#include "runtime/buses/can/can_record.hpp"
#include "runtime/buses/can/can_wiring.hpp"

namespace hil::buses {
namespace can {
namespace {

std::unique_ptr<BusWiring> wire_can(const config::BusSection& section, config::Diagnostics& diagnostics) {
  const auto& can_section = dynamic_cast<const CanSection&>(section);
  auto description = describe_can_device(can_section, diagnostics);
  if (!description) return nullptr;
  return std::make_unique<CanWiring>(can_section, std::move(*description));
}

std::vector<DoctorLine> socketcan_lines() {
  const int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (fd < 0) {
    return {{"SocketCAN", std::string("not in this kernel (") + std::strerror(errno) +
                              "); the virtual bus works without it"}};
  }
  close(fd);
  std::string interfaces;
  if (struct if_nameindex* all = if_nameindex(); all != nullptr) {
    for (struct if_nameindex* i = all; i->if_index != 0; ++i) {
      if (std::strstr(i->if_name, "can") != nullptr) interfaces += std::string(" ") + i->if_name;
    }
    if_freenameindex(all);
  }
  return {{"SocketCAN",
           interfaces.empty()
               ? "in the kernel, but no interface; ip link add dev vcan0 type vcan makes a virtual one"
               : "interfaces:" + interfaces}};
}

}  // namespace
}  // namespace can

BusType can_type() {
  return {.section = can::can_section_type(),
          .title = "CAN",
          .columns = can::can_columns(),
          .wire = can::wire_can,
          .doctor_lines = can::socketcan_lines};
}

}  // namespace hil::buses
