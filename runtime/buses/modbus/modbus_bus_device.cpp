#include "runtime/buses/modbus/modbus_bus_device.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "runtime/buses/modbus/modbus_fault.hpp"
#include "runtime/buses/modbus/modbus_record.hpp"
#include "runtime/buses/modbus/modbus_settings.hpp"

namespace hil::buses::modbus {
namespace {

/// A TCP port on loopback that no program uses now.
std::uint16_t free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  const bool ok = fd >= 0 && bind(fd, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (fd >= 0) close(fd);
  if (!ok) throw io::DeviceError(std::string("no free TCP port on loopback: ") + std::strerror(errno));
  return ntohs(address.sin_port);
}

}  // namespace

ModbusBusDevice::ModbusBusDevice(const ModbusSection& section, RunEnvironment environment)
    : endpoint_{.host = section.host, .port = section.port ? *section.port : free_port()} {
  if (section.role == io::modbus::Role::client) {
    io::modbus::ClientSettings settings = client_settings(section, endpoint_);
    settings.on_thread_start = std::move(environment.on_thread_start);
    settings.stop_requested = &environment.stop_requested;
    client_ = std::make_unique<io::modbus::ClientDevice>(std::move(settings), section.registers);
  } else {
    io::modbus::ServerSettings settings = server_settings(section, endpoint_);
    settings.on_thread_start = std::move(environment.on_thread_start);
    server_ = std::make_unique<io::modbus::ServerDevice>(std::move(settings), section.registers);
  }
}

io::Device& ModbusBusDevice::device() noexcept {
  return client_ ? static_cast<io::Device&>(*client_) : static_cast<io::Device&>(*server_);
}

void ModbusBusDevice::add_fault(const InjectedFault& fault) {
  const auto injected = dynamic_cast<const ModbusFault&>(*fault.effect).interference();
  client_ ? client_->add_fault(injected) : server_->add_fault(injected);
}

contribution::BusRecord ModbusBusDevice::record() const {
  return to_record(client_ ? record_of(*client_) : record_of(*server_));
}

}  // namespace hil::buses::modbus
