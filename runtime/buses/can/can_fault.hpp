#pragma once
// The kinds of fault of a CAN bus and of its messages (faults/table.def), and the port between a bus and a
// kind.
//
// Threads: kinds on any; the rest on the thread that wires and opens the run.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "io/can/can_device.hpp"
#include "io/can/frame_fault.hpp"
#include "runtime/config/fault_section.hpp"

namespace hil::buses::can {

/// What the kinds derive their effects from. `message`: as io::can::CanDevice::fault_problem; empty: the
/// fault is one of the bus.
class CanFault : public config::FaultEffect {
 public:
  /// Why the device can not have it, as a clause; empty: it can.
  virtual std::string problem(const io::can::CanDevice& device, const std::string& message) const = 0;
  /// Before the start of the device, without a problem(). `seed`: of random numbers of the fault.
  virtual void add_to(io::can::CanDevice& device, const std::string& message, std::uint64_t seed) const = 0;
};

/// A fault of the frames of a message.
class MessageFault : public CanFault {
 public:
  std::string problem(const io::can::CanDevice& device, const std::string& message) const final {
    return device.fault_problem(message, *make(0));
  }
  void add_to(io::can::CanDevice& device, const std::string& message, std::uint64_t seed) const final {
    device.add_fault(message, make(seed));
  }

 private:
  virtual std::unique_ptr<io::can::FrameFault> make(std::uint64_t seed) const = 0;
};

/// A fault of frames that needs no description of them, and that all frames can have.
class AnyFrameFault : public io::can::FrameFault {
 public:
  std::string problem(const io::can::MessageLayout& /*layout*/) const override { return {}; }
  std::string played_problem(std::span<const io::can::PlayedFrame> /*of_identifier*/) const override {
    return {};
  }
};

/// A fault of frames that needs their description in the DBC file.
class DescribedFrameFault : public io::can::FrameFault {
 public:
  std::string problem(const io::can::MessageLayout& /*layout*/) const override { return {}; }
  std::string played_problem(std::span<const io::can::PlayedFrame> /*of_identifier*/) const final {
    return "only a message of the DBC file can be stuck or have a wrong counter or checksum";
  }
};

/// All kinds, for the section type of CAN buses.
const std::vector<config::FaultKind>& can_fault_kinds();

}  // namespace hil::buses::can
