#include "io/modbus/value_watch.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace hil::io::modbus {

namespace {

std::string shown(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.12g", value);
  return text.data();
}

}  // namespace

std::string range_text(const RegisterEntry& entry) {
  const ValueRange range = range_of(entry);
  return shown(range.lowest) + " to " + shown(range.highest);
}

ValueWatch::ValueWatch(const RegisterMap& map, std::string device, EventList& events)
    : map_(map), device_(std::move(device)), events_(events), episodes_(map.entries.size()) {}

void ValueWatch::note(std::size_t entry, Conversion conversion, double value, RunTimeNs time_ns) {
  const RegisterEntry& what = map_.entries[entry];
  switch (conversion) {
    case Conversion::exact:
      episodes_[entry] = Episode::none;
      break;
    case Conversion::out_of_range: {
      (what.writable ? saturated_outputs_ : out_of_range_inputs_).fetch_add(1, std::memory_order_relaxed);
      if (episodes_[entry] == Episode::out_of_range) break;
      const ValueRange range = range_of(what);
      const std::string limit = shown(value < range.lowest ? range.lowest : range.highest);
      begin_episode(entry, Episode::out_of_range, time_ns,
                    shown(value) + " is outside " + range_text(what) +
                        (what.writable ? "; " + limit + " is written" : "; it is read as it is"));
      break;
    }
    case Conversion::refused:
      (what.writable ? not_a_number_outputs_ : not_a_number_inputs_).fetch_add(1, std::memory_order_relaxed);
      if (episodes_[entry] == Episode::not_a_number) break;
      begin_episode(entry, Episode::not_a_number, time_ns,
                    what.writable ? "the value to write is not a number; the register keeps its value"
                                  : "the register holds no finite number; the signal keeps its last value");
      break;
  }
}

void ValueWatch::note_refused_write(std::size_t entry, double value, RunTimeNs time_ns) {
  if (episodes_[entry] == Episode::refused_write) return;
  begin_episode(entry, Episode::refused_write, time_ns,
                "a client wrote " + shown(value) + ", outside " + range_text(map_.entries[entry]) +
                    "; it was answered with exception 3 and changed nothing");
}

void ValueWatch::begin_episode(std::size_t entry, Episode episode, RunTimeNs time_ns,
                               const std::string& what) {
  episodes_[entry] = episode;
  events_.add(time_ns, device_ + ": register " + map_.entries[entry].name + ": " + what);
}

ValueCounters ValueWatch::counters() const noexcept {
  return {saturated_outputs_.load(std::memory_order_relaxed),
          out_of_range_inputs_.load(std::memory_order_relaxed),
          not_a_number_outputs_.load(std::memory_order_relaxed),
          not_a_number_inputs_.load(std::memory_order_relaxed)};
}

}  // namespace hil::io::modbus
