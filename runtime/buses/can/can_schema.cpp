#include "runtime/buses/can/can_schema.hpp"

#include "runtime/config/shared_schemas.hpp"

namespace hil::buses::can {
namespace {

using namespace config;

Schema sent_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("period", duration_schema(min_duration_s),
                          "The period of sending, a multiple of the bus's period. Left out: GenMsgCycleTime "
                          "of the DBC file, else one period of the bus."),
          Field::with_default(
              "offset", duration_schema(0.0), "0 ms",
              "The shift of sending: a multiple of the bus's period, less than the message's period."),
          Field::optional("counter", Schema::name(), "The signal that counts the frames."),
          Field::optional("checksum", Schema::name(),
                          "The signal that carries the checksum (CRC-8 SAE J1850)."),
          Field::with_default(
              "signals", Schema::map(Schema::text()), "{}",
              "The source of each signal: a signal of the run, a number, or a value name of the DBC file. "
              "Other signals have their start value (GenSigStartValue), else their safe value."),
          Field::with_default("safe", Schema::map(Schema::text()), "{}",
                              "The safe value of each signal, a number or a value name. Other signals: 0."),
      });
}

Schema received_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("timeout", duration_schema(0.0),
                          "The age beyond which the signals are not fresh and have their safe values; a "
                          "multiplexed signal by its own last value. 0 ms: no limit. Left out: three times "
                          "GenMsgCycleTime of the DBC file, else no limit."),
          Field::optional("counter", Schema::name(), "The signal that counts the frames. Gaps are counted."),
          Field::optional("checksum", Schema::name(),
                          "The signal that carries the checksum. It is verified."),
          Field::with_default("safe", Schema::map(Schema::text()), "{}",
                              "The safe value of each signal, a number or a value name. Other signals: 0."),
      });
}

}  // namespace

Schema can_schema() {
  return Schema::record({
      Field::needed("bus", Schema::name(), "The bus's name. Its signals begin with can.NAME."),
      Field::with_default("device", Schema::text(), "virtual",
                          "virtual, or socketcan:INTERFACE for an interface of the kernel."),
      Field::needed("database", Schema::file(), "The DBC file."),
      Field::needed("rate", rate_schema(),
                    "The rate at which frames are read and sent. It divides the base rate."),
      Field::with_default("bit_rate", Schema::integer(1'000, 20'000'000), "500000",
                          "The bit rate in bits per second, for the bus load."),
      Field::optional("priority", thread_priority_schema(),
                      "The real-time priority of the device's thread. Left out: an ordinary thread."),
      Field::with_default("send", Schema::list(sent_schema()), "[]", "The messages the run sends."),
      Field::with_default("receive", Schema::list(received_schema()), "[]", "The messages the run reads."),
      Field::optional("faults",
                      Schema::record({
                          Field::with_default("drop", Schema::number(0.0, 1.0), "0",
                                              "The probability that a frame is lost."),
                          Field::with_default("corrupt", Schema::number(0.0, 1.0), "0",
                                              "The probability that a bit of a frame is inverted."),
                          Field::with_default("delay", duration_schema(0.0, 60.0), "0 ms",
                                              "The delay of each frame. Under clock: virtual, rounded up to "
                                              "whole periods of the bus's rate."),
                      }),
                      "The faults that a virtual bus injects."),
      may_be_lost_field("The bus: its interface goes down or away, or its controller goes bus-off."),
  });
}

}  // namespace hil::buses::can
