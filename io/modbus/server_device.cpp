#include "io/modbus/server_device.hpp"

#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

std::vector<bool> written_by_clients(const RegisterMap& map) {
  require(mistakes_in(map, Role::server).empty(),
          "ServerDevice: the register map has mistakes (see mistakes_in)");
  std::vector<bool> allowed;
  allowed.reserve(map.entries.size());
  for (const RegisterEntry& entry : map.entries)
    allowed.push_back(!entry.writable);
  return allowed;
}

}  // namespace

ServerDevice::ServerDevice(ServerSettings settings, RegisterMap map)
    : settings_(std::move(settings)),
      map_(std::move(map)),
      label_("Modbus unit " + settings_.name),
      releases_(std::vector<double>{}),
      readings_({}),
      freshness_(map_.read_count(),
                 std::chrono::duration_cast<std::chrono::nanoseconds>(settings_.max_age).count()),
      bank_(map_, written_by_clients(map_)),
      server_(bank_, settings_.limits,
              {.before_request = [this] { bring_outputs_up_to_date(); },
               .after_write = [this](const RequestRange& range) { take_inputs(range); },
               .on_refused_write =
                   [this](const RegisterBank::OutOfRange& refused) { note_refused_write(refused); },
               .interference = [this] { return faults_.interference(); },
               .on_frame = [this] { faults_.note_request(); },
               .on_cut = [this] { faults_.note_request(); },
               .run_time = [this] { return stamp_ns(); },
               .on_delay = [this] { faults_.note_held_request(); }}),
      values_(map_, label_, events_) {
  require(settings_.max_age.count() >= 0 && settings_.lockstep_limit.count() > 0,
          "ServerDevice: a time limit is not positive");
  build_channels();
}

ServerDevice::~ServerDevice() {
  stop();
}

void ServerDevice::build_channels() {
  for (std::size_t index = 0; index < map_.entries.size(); ++index) {
    const RegisterEntry& entry = map_.entries[index];
    (entry.writable ? outputs_ : inputs_)
        .push_back({entry.name, entry.unit, entry.minimum, entry.maximum, entry.safe_value});
    (entry.writable ? output_entries_ : input_entries_).push_back(index);
    if (entry.writable) continue;
    groups_.push_back({entry.name, newest_readings_.size(), 1, loss_timeout_ns()});
    newest_readings_.push_back({entry.safe_value, 0, false});
  }
}

void ServerDevice::start(const RunClock& clock, Pacing pacing) {
  require(!started_, "ServerDevice::start: started already");
  clock_ = &clock;
  pacing_ = pacing;
  std::vector<double> safe_values;
  for (const ChannelInfo& output : outputs_)
    safe_values.push_back(output.safe_value);
  // The slots get their sizes here, so that the tick does not allocate.
  releases_.reset(safe_values);
  readings_.reset({.values = newest_readings_, .arrivals = arrivals_.completed()});
  stopping_.store(false);
  safe_requested_.store(false);
  arrivals_.begin();
  wake_event_ = Descriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake_event_.open()) {
    throw DeviceError("Modbus server " + settings_.name +
                      " can not be started: " + std::generic_category().message(errno) + " (eventfd)");
  }
  server_.listen(settings_.endpoint, "Modbus server " + settings_.name);
  port_.store(server_.port());
  started_ = true;
  if (pacing_ == Pacing::realtime) thread_ = std::thread([this] { run(); });
}

void ServerDevice::stop() noexcept {
  if (!started_) return;
  stopping_.store(true);
  if (thread_.joinable()) {
    wake();
    thread_.join();
  }
  const std::scoped_lock lock(lockstep_mutex_);
  server_.close();
  arrivals_.latch_all();
  port_.store(0);
  started_ = false;
}

// ---- called by the tick thread

void ServerDevice::latch_inputs(std::span<Sample> samples) noexcept {
  require(samples.size() == inputs_.size(),
          "ServerDevice::latch_inputs: as many samples as inputs are needed");
  if (clock_ == nullptr) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples[i] = Sample{.value = inputs_[i].safe_value};
    return;
  }
  readings_.take_newest();
  arrivals_.latch(readings_.current().arrivals);
  const RunTimeNs max_age_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(settings_.max_age).count();
  const RunTimeNs now_ns = clock_->now_ns();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Reading& reading = readings_.current().values[i];
    if (!reading.valid) {
      samples[i] = Sample{.value = inputs_[i].safe_value};
      continue;
    }
    const RunTimeNs time_ns = clock_->to_run_time(reading.time_ns);
    if (max_age_ns > 0 && now_ns - time_ns > max_age_ns) {
      samples[i] = Sample{.value = inputs_[i].safe_value, .time_ns = time_ns};
    } else {
      samples[i] = Sample{.value = reading.value, .time_ns = time_ns, .fresh = true};
    }
  }
  freshness_.observe(samples, now_ns);
}

bool ServerDevice::keep_arrivals(std::size_t input) {
  arrivals_.keep(input, 1, arrivals_.kept_inputs() + 1);
  return true;
}

std::optional<Arrival> ServerDevice::next_arrival(std::span<InputValue> values) noexcept {
  std::optional<Arrival> arrival = arrivals_.take(values);
  if (arrival) arrival->time_ns = clock_->to_run_time(arrival->time_ns);
  return arrival;
}

void ServerDevice::release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept {
  require(values.size() == outputs_.size(),
          "ServerDevice::release_outputs: as many values as outputs are needed");
  (void)tick_ns;  // registers carry no time
  if (clock_ == nullptr) return;
  std::copy(values.begin(), values.end(), releases_.draft().begin());
  releases_.publish();  // no wake-up: the thread takes it when a client sends a request
}

void ServerDevice::set_fault(std::size_t number, bool active) noexcept {
  faults_.set(number, active);
  if (pacing_ == Pacing::realtime) wake();
}

bool ServerDevice::exchange(RunTimeNs tick_ns) {
  require(started_ && pacing_ == Pacing::lockstep, "ServerDevice::exchange: only after start in lockstep");
  const std::scoped_lock lock(lockstep_mutex_);
  exchange_tick_ns_ = tick_ns;
  bring_outputs_up_to_date();
  const auto until = std::chrono::steady_clock::now() + settings_.lockstep_limit;
  while (server_.serve(std::chrono::milliseconds(0), -1)) {
    if (std::chrono::steady_clock::now() >= until) return false;
  }
  return true;
}

void ServerDevice::enter_safe_state() noexcept {
  faults_.end_all();
  safe_requested_.store(true);
  if (clock_ == nullptr) return;
  if (pacing_ == Pacing::realtime) return wake();
  const std::scoped_lock lock(lockstep_mutex_);
  bring_outputs_up_to_date();
}

void ServerDevice::wake() noexcept {
  const std::uint64_t one = 1;
  // The write fails only if the event is already signalled.
  [[maybe_unused]] const ssize_t written = ::write(wake_event_.get(), &one, sizeof(one));
}

RunTimeNs ServerDevice::loss_timeout_ns() const noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(settings_.max_age).count();
}

// ---- called by the device's thread, or by exchange()

void ServerDevice::run() noexcept {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);  // the main thread handles the executive's signals
  pthread_setname_np(pthread_self(), "hil-modbus-sv");
  if (settings_.on_thread_start) settings_.on_thread_start();
  while (!stopping_.load()) {
    server_.serve(std::chrono::milliseconds(-1), wake_event_.get());
    std::uint64_t events = 0;
    if (::read(wake_event_.get(), &events, sizeof(events)) > 0) bring_outputs_up_to_date();
  }
}

void ServerDevice::bring_outputs_up_to_date() noexcept {
  // Safe values are requested before the newest release is taken and applied after it, so that they override
  // it.
  const bool safe = safe_requested_.exchange(false);
  const bool newer = releases_.take_newest();
  if (!safe && !newer) return;
  if (safe) arrivals_.end();
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const double value = safe ? outputs_[i].safe_value : releases_.current()[i];
    const std::size_t index = output_entries_[i];
    values_.note(index, bank_.store(map_.entries[index], value), value, stamp_ns());
  }
}

void ServerDevice::take_inputs(const RequestRange& written) noexcept {
  const RunTimeNs time_ns = stamp_ns();
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const RegisterEntry& entry = map_.entries[input_entries_[i]];
    if (!touches(entry, written)) continue;
    const Decoded decoded = bank_.load(entry);
    values_.note(input_entries_[i], decoded.conversion, decoded.value, time_ns);
    if (decoded.conversion == Conversion::refused) continue;
    newest_readings_[i] = {decoded.value, time_ns, true};
    arrivals_.add(i, decoded.value);
  }
  arrivals_.complete(time_ns);
  std::copy(newest_readings_.begin(), newest_readings_.end(), readings_.draft().values.begin());
  readings_.draft().arrivals = arrivals_.completed();
  readings_.publish();
}

void ServerDevice::note_refused_write(const RegisterBank::OutOfRange& refused) noexcept {
  values_.note_refused_write(refused.entry, refused.value, stamp_ns());
}

RunTimeNs ServerDevice::stamp_ns() const noexcept {
  return pacing_ == Pacing::lockstep ? exchange_tick_ns_ : clock_->now_ns();
}

std::vector<DeviceEvent> ServerDevice::events_since(std::size_t first) const {
  if (clock_ == nullptr) return {};
  freshness_.report(inputs_, label_, "was not written by a client", events_);
  return events_.since(first, *clock_);
}

}  // namespace hil::io::modbus
