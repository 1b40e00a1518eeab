#include "runtime/buses/can/socketcan_lines.hpp"

#include <linux/can.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace hil::buses::can {

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

}  // namespace hil::buses::can
