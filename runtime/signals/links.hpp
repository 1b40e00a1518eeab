#pragma once
// The signals that the channels of a device and the inputs of a module are connected with.

#include <vector>

#include <hil/unit.hpp>

#include "runtime/signals/signal_table.hpp"

namespace hil::signals {

/// The source of an output's value.
struct Source {
  SignalId signal;  ///< invalid: the constant
  double constant = 0.0;
  units::Conversion conversion{};  ///< of the signal's values to the output's unit
};

/// A signal as a module reads it.
struct InputSource {
  SignalId signal;                 ///< invalid: not connected
  units::Conversion conversion{};  ///< of its values to the input's unit
};

struct Links {
  std::vector<SignalId> inputs;      ///< by input channel
  std::vector<Source> outputs;       ///< by output channel
  SignalId connected;                ///< 1 while the device is connected, else 0; invalid: no signal
  std::vector<SignalId> fresh;       ///< by input group: 1 while one of its inputs is fresh, else 0;
                                     ///< invalid: no signal
  std::vector<SignalId> rejected{};  ///< by input group: its refused frames; invalid: no signal
};

}  // namespace hil::signals
