#include "io/modbus/client_device.hpp"

#include <pthread.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <iterator>
#include <utility>

#include "io/modbus/register_codec.hpp"
#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

constexpr auto relaxed = std::memory_order_relaxed;
constexpr std::uint8_t exception_illegal_address = 2;

RequestRange range_of(const PlannedRequest& plan, bool writes) {
  return {writes, plan.table, plan.address, plan.count};
}

std::optional<std::size_t> own_entry(const RegisterMap& map, const std::string& name) {
  if (name.empty()) return std::nullopt;
  const RegisterEntry* entry = map.find(name);
  require(entry != nullptr && entry->writable,
          "ClientDevice: the heartbeat or run time entry is not a writable entry");
  return static_cast<std::size_t>(entry - map.entries.data());
}

ChannelInfo channel_of(const RegisterEntry& entry) {
  return {entry.name, entry.unit, entry.minimum, entry.maximum, entry.safe_value};
}

/// Where the heartbeat starts and ends: the entry's range within its type.
std::pair<double, double> heartbeat_range(const RegisterEntry& entry) {
  std::array<std::uint16_t, widest_value> registers{};
  encode(entry, std::max(entry.minimum, 0.0), registers);
  const double first = decode(entry, registers).value;
  encode(entry, entry.maximum, registers);
  return {first, decode(entry, registers).value};
}

/// The main thread handles the executive's signals.
void block_all_signals() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, nullptr);
}

}  // namespace

ClientDevice::ClientDevice(ClientSettings settings, RegisterMap map)
    : settings_(std::move(settings)),
      map_(std::move(map)),
      description_("Modbus unit " + settings_.name + " (" + settings_.endpoint.to_text() + ")"),
      label_("Modbus unit " + settings_.name),
      run_time_entry_(own_entry(map_, settings_.run_time_ms_entry)),
      heartbeat_entry_(own_entry(map_, settings_.heartbeat_entry)),
      releases_(Release{}),
      readings_({}),
      freshness_(map_.read_count(),
                 std::chrono::duration_cast<std::chrono::nanoseconds>(settings_.max_age).count()),
      session_(settings_.unit),
      values_(map_, label_, events_),
      reconnect_pause_(settings_.reconnect_pause_min) {
  require(mistakes_in(map_, Role::client).empty(),
          "ClientDevice: the register map has mistakes (see mistakes_in)");
  require(settings_.response_timeout.count() > 0 && settings_.start_timeout.count() > 0 &&
              settings_.reconnect_pause_min.count() > 0 && settings_.max_age.count() > 0 &&
              settings_.reconnect_pause_max >= settings_.reconnect_pause_min &&
              settings_.lockstep_limit.count() > 0 && settings_.stop_limit.count() > 0,
          "ClientDevice: a time limit is not positive");
  build_channels();
  build_requests();
}

ClientDevice::~ClientDevice() {
  stop();
}

void ClientDevice::build_channels() {
  channel_of_input_.resize(map_.entries.size());
  for (std::size_t index = 0; index < map_.entries.size(); ++index) {
    const RegisterEntry& entry = map_.entries[index];
    if (!entry.writable) {
      channel_of_input_[index] = inputs_.size();
      inputs_.push_back(channel_of(entry));
      input_entries_.push_back(index);
    } else if (index != run_time_entry_ && index != heartbeat_entry_) {
      outputs_.push_back(channel_of(entry));
      output_entries_.push_back(index);
      wanted_.push_back(entry.safe_value);
    }
  }
  for (std::size_t channel = 0; channel < inputs_.size(); ++channel)
    groups_.push_back({inputs_[channel].name, channel, 1, loss_timeout_ns()});
  newest_readings_.resize(inputs_.size());
  for (std::size_t channel = 0; channel < inputs_.size(); ++channel) {
    newest_readings_[channel].value = inputs_[channel].safe_value;
  }
  if (heartbeat_entry_) heartbeat_ = heartbeat_range(map_.entries[*heartbeat_entry_]).first;
}

void ClientDevice::build_requests() {
  std::vector<std::size_t> written = output_entries_;
  if (heartbeat_entry_) written.push_back(*heartbeat_entry_);
  std::vector<PlannedRequest> plans = plan_requests(map_, written, Access::write, 0);
  if (run_time_entry_) {
    plans.push_back(plan_requests(map_, std::array{*run_time_entry_}, Access::write, 0).front());
  }
  for (PlannedRequest& plan : plans) {
    WriteRequest request;
    request.image.resize(plan.count);
    request.plan = std::move(plan);
    // A refused value leaves its registers unchanged, so they must be valid from the start.
    for (const std::size_t entry : request.plan.entries)
      encode_into(request, entry, map_.entries[entry].safe_value);
    write_requests_.push_back(std::move(request));
  }
  read_requests_ = plan_requests(map_, input_entries_, Access::read, settings_.max_gap);
}

void ClientDevice::start(const RunClock& clock, Pacing pacing) {
  require(!started_, "ClientDevice::start: started already");
  clock_ = &clock;
  pacing_ = pacing;
  // The prototypes get their sizes here, so that the tick does not allocate.
  releases_.reset(Release{wanted_, 0});
  readings_.reset({.values = newest_readings_, .arrivals = arrivals_.completed()});
  due_ = false;
  stopping_.store(false);
  safe_requested_.store(false);
  arrivals_.begin();
  address_ = resolve(settings_.endpoint);
  const CycleLimit limit = limit_from_now(settings_.start_timeout);
  while (!connect(limit)) {
    if (settings_.stop_requested != nullptr && settings_.stop_requested->load())
      throw DeviceError("the run was stopped before " + description_ + " was reached: " + connect_fault_);
    if (WallClock::now() + settings_.reconnect_pause_min >= limit.until) {
      throw DeviceError(description_ + " can not be reached: " + connect_fault_ + "; tried for " +
                        std::to_string(settings_.start_timeout.count()) +
                        " ms. Check that the unit is on and that the address and port are right");
    }
    std::this_thread::sleep_for(settings_.reconnect_pause_min);
  }
  set_fault("");
  connected_.store(true, relaxed);
  answered_.store(false, relaxed);
  started_ = true;
  if (pacing_ == Pacing::realtime) thread_ = std::thread([this] { run(); });
}

void ClientDevice::stop() noexcept {
  if (!started_) return;
  if (thread_.joinable()) {
    stopping_.store(true);
    wake_signal_.wake();
    thread_.join();
  }
  const std::scoped_lock lock(lockstep_mutex_, health_mutex_);
  session_.disconnect();
  arrivals_.latch_all();
  started_ = false;
  connected_.store(false, relaxed);
}

// ---- called by the tick thread

void ClientDevice::latch_inputs(std::span<Sample> samples) noexcept {
  require(samples.size() == inputs_.size(),
          "ClientDevice::latch_inputs: as many samples as inputs are needed");
  if (clock_ == nullptr) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      samples[i] = Sample{.value = inputs_[i].safe_value};
    return;
  }
  readings_.take_newest();
  arrivals_.latch(readings_.current().arrivals);
  const RunTimeNs now_ns = clock_->now_ns();
  const RunTimeNs oldest_ns =
      now_ns - std::chrono::duration_cast<std::chrono::nanoseconds>(settings_.max_age).count();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Reading& reading = readings_.current().values[i];
    if (!reading.valid) {
      samples[i] = Sample{.value = inputs_[i].safe_value};
    } else if (reading.time_ns < oldest_ns) {
      samples[i] = Sample{.value = inputs_[i].safe_value, .time_ns = reading.time_ns};
    } else {
      samples[i] = Sample{.value = reading.value, .time_ns = reading.time_ns, .fresh = true};
    }
  }
  freshness_.observe(samples, now_ns);
}

bool ClientDevice::keep_arrivals(std::size_t input) {
  arrivals_.keep(input, 1, arrivals_.kept_inputs() + 1);
  return true;
}

std::optional<Arrival> ClientDevice::next_arrival(std::span<InputValue> values) noexcept {
  std::optional<Arrival> arrival = arrivals_.take(values);
  if (arrival) arrival->time_ns = clock_->to_run_time(arrival->time_ns);
  return arrival;
}

void ClientDevice::release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept {
  require(values.size() == outputs_.size(),
          "ClientDevice::release_outputs: as many values as outputs are needed");
  if (clock_ == nullptr) return;
  cycle_watch_.release(tick_ns);
  Release& release = releases_.draft();
  std::copy(values.begin(), values.end(), release.values.begin());
  release.tick_ns = tick_ns;
  if (releases_.publish()) counters_.superseded.fetch_add(1, relaxed);
  if (pacing_ == Pacing::realtime) wake_signal_.wake();
}

bool ClientDevice::exchange(RunTimeNs tick_ns) {
  require(started_ && pacing_ == Pacing::lockstep, "ClientDevice::exchange: only after start in lockstep");
  const std::scoped_lock lock(lockstep_mutex_);
  if (take_work(); !due_) return true;
  const LockstepHold hold = faults_.hold(is_away_, tick_ns, settings_.response_timeout, reply_due_ns_);
  if (hold.fault != nullptr && connected_.load(relaxed)) lose_connection(hold.fault);
  return hold.is_held || cycle(limit_from_now(settings_.lockstep_limit));
}

void ClientDevice::enter_safe_state() noexcept {
  faults_.end_all();
  safe_requested_.store(true);
  if (clock_ == nullptr) return;
  if (pacing_ == Pacing::realtime) return wake_signal_.wake();
  const std::scoped_lock lock(lockstep_mutex_);
  take_work();
  if (due_ && started_ && !is_away_) cycle(limit_from_now(settings_.lockstep_limit));
}

// ---- called by the device's thread, or by exchange()

void ClientDevice::run() noexcept {
  block_all_signals();
  pthread_setname_np(pthread_self(), "hil-modbus-cl");
  if (settings_.on_thread_start) settings_.on_thread_start();
  while (!stopping_.load()) {
    wait_for_work();
    if (stopping_.load()) break;
    take_work();
    if (due_ && (session_.connected() || WallClock::now() >= next_connect_)) cycle({});
  }
  take_work();
  if (due_) cycle(limit_from_now(settings_.stop_limit));
}

/// After a failed cycle: waits for the end of the pause, whether or not new outputs are released.
void ClientDevice::wait_for_work() {
  if (due_ && !session_.connected()) return wake_signal_.wait_for(next_connect_ - WallClock::now());
  wake_signal_.wait();
}

void ClientDevice::take_work() noexcept {
  // Safe values are requested before the newest release is taken and applied after it, so that they override
  // it.
  const bool safe = safe_requested_.exchange(false);
  if (releases_.take_newest()) {
    std::copy(releases_.current().values.begin(), releases_.current().values.end(), wanted_.begin());
    wanted_tick_ns_ = releases_.current().tick_ns;
    due_ = true;
  }
  if (safe) {
    arrivals_.end();
    for (std::size_t i = 0; i < outputs_.size(); ++i)
      wanted_[i] = outputs_[i].safe_value;
    for (WriteRequest& request : write_requests_)
      request.written.clear();  // send it even if nothing changed
    due_ = true;
  }
}

bool ClientDevice::cycle(const CycleLimit& limit) {
  const bool good = run_cycle(limit);
  cycle_watch_.end_cycle();
  return good;
}

bool ClientDevice::run_cycle(const CycleLimit& limit) {
  cycle_fault_.clear();
  const Interference interference = faults_.begin_cycle();
  session_.set_interference(interference, pacing_ == Pacing::realtime);
  if (interference.is_disconnected) {
    lose_connection("disconnected by a fault of the scenario");
    return false;
  }
  if (session_.connected() && !session_.usable()) {
    // Closed, or unsolicited bytes, while no request was pending: reconnect at once, since no request is
    // lost.
    counters_.errors.fetch_add(1, relaxed);
    set_fault(session_.fault());
  }
  if (!session_.connected() && !connect(limit)) return false;
  encode_outputs();
  if (!write_all(limit) || !read_all(limit)) return false;
  due_ = false;
  reconnect_pause_ = settings_.reconnect_pause_min;
  connected_.store(true, relaxed);
  set_fault(cycle_fault_);
  return true;
}

bool ClientDevice::connect(const CycleLimit& limit) {
  Connection connection = connect_within(address_, request_limit(limit));
  if (!connection.socket.open()) {
    connect_fault_ = std::move(connection.fault);
    lose_connection("connecting: " + connect_fault_);
    return false;
  }
  session_.adopt(std::move(connection.socket));
  for (WriteRequest& request : write_requests_)
    request.written.clear();
  counters_.connects.fetch_add(1, relaxed);
  return true;
}

Conversion ClientDevice::encode_into(WriteRequest& request, std::size_t entry, double value) {
  const std::size_t first = map_.entries[entry].address - request.plan.address;
  return encode(map_.entries[entry], value, std::span(request.image).subspan(first));
}

void ClientDevice::encode_outputs() {
  if (heartbeat_entry_) {
    const auto [first, last] = heartbeat_range(map_.entries[*heartbeat_entry_]);
    heartbeat_ = heartbeat_ + 1.0 > last ? first : heartbeat_ + 1.0;
  }
  constexpr double ns_per_ms = 1e6;
  for (WriteRequest& request : write_requests_) {
    for (const std::size_t entry : request.plan.entries) {
      double value = heartbeat_;
      if (entry == run_time_entry_) {
        value = static_cast<double>(wanted_tick_ns_) / ns_per_ms;
      } else if (entry != heartbeat_entry_) {
        // output_entries_ is sorted: the map's order.
        const auto found = std::lower_bound(output_entries_.begin(), output_entries_.end(), entry);
        value = wanted_[static_cast<std::size_t>(found - output_entries_.begin())];
      }
      values_.note(entry, encode_into(request, entry, value), value, wanted_tick_ns_);
    }
  }
}

bool ClientDevice::write_all(const CycleLimit& limit) {
  const bool is_due = read_requests_.empty() && now_ns() - last_reply_ns_ >= loss_timeout_ns() / 2;
  for (WriteRequest& request : write_requests_) {
    if (!settings_.write_unchanged && !is_due && request.image == request.written) continue;
    const Reply reply =
        session_.write(request.plan.table, request.plan.address, request.image, request_limit(limit));
    if (!judge_reply(reply, true, request.plan)) return false;
    if (reply == Reply::good) {
      request.written = request.image;
      request.refused_since_ns.reset();
    } else {
      request.written.clear();
      note_refusal(request);
    }
  }
  return true;
}

/// A busy unit may refuse a write for a moment. A unit that refuses it for longer than max_age does not get
/// its outputs.
void ClientDevice::note_refusal(WriteRequest& request) {
  if (!request.refused_since_ns) request.refused_since_ns = now_ns();
  if (now_ns() - *request.refused_since_ns <= loss_timeout_ns()) return;
  if (faults_.interference().exception != 0) return;
  const std::scoped_lock lock(health_mutex_);
  if (!send_fault_.empty()) return;
  send_fault_ = description_ + " has refused outputs for more than " +
                std::to_string(settings_.max_age.count()) +
                " ms: " + text_of(range_of(request.plan, true), map_) + ": " + session_.fault();
}

bool ClientDevice::read_all(const CycleLimit& limit) {
  std::array<std::uint16_t, max_bits_read> registers{};
  for (std::size_t i = 0; i < read_requests_.size();) {
    const PlannedRequest& plan = read_requests_[i];
    const std::span<std::uint16_t> image = std::span(registers).first(plan.count);
    const Reply reply = session_.read(plan.table, plan.address, image, request_limit(limit));
    if (!judge_reply(reply, false, plan)) return false;
    if (refused_for_its_gaps(reply, plan)) {
      split_at_gaps(i);
      continue;
    }
    ++i;
    if (reply != Reply::good) continue;
    const RunTimeNs read_ns = now_ns();
    for (const std::size_t index : plan.entries) {
      const RegisterEntry& entry = map_.entries[index];
      const Decoded decoded = decode(entry, image.subspan(entry.address - plan.address));
      values_.note(index, decoded.conversion, decoded.value, read_ns);
      if (decoded.conversion == Conversion::refused) continue;
      newest_readings_[channel_of_input_[index]] = {decoded.value, read_ns, true};
      arrivals_.add(channel_of_input_[index], decoded.value);
    }
    arrivals_.complete(read_ns);
  }
  readings_.draft().values = newest_readings_;
  readings_.draft().arrivals = arrivals_.completed();
  readings_.publish();
  return true;
}

bool ClientDevice::refused_for_its_gaps(Reply reply, const PlannedRequest& plan) const {
  if (reply != Reply::exception || session_.exception_code() != exception_illegal_address) return false;
  std::size_t covered = 0;
  for (const std::size_t index : plan.entries)
    covered += width_of(map_.entries[index].type);
  return covered < plan.count;
}

/// Replaces the request by its parts; the current cycle continues with the first part.
void ClientDevice::split_at_gaps(std::size_t read_request) {
  const PlannedRequest whole = std::move(read_requests_[read_request]);
  std::vector<PlannedRequest> parts = plan_requests(map_, whole.entries, Access::read, 0);
  events_.add(wanted_tick_ns_, label_ + ": it refused to read " +
                                   place_of(whole.table, whole.address, whole.count) +
                                   " (exception 2), which has gaps; from now on it is read in " +
                                   std::to_string(parts.size()) + " requests");
  const auto at = read_requests_.erase(read_requests_.begin() + static_cast<std::ptrdiff_t>(read_request));
  read_requests_.insert(at, std::make_move_iterator(parts.begin()), std::make_move_iterator(parts.end()));
}

/// True when the cycle can continue with the next request.
bool ClientDevice::judge_reply(Reply reply, bool writes, const PlannedRequest& plan) {
  counters_.requests.fetch_add(1, relaxed);
  faults_.note_request();
  if (reply == Reply::good || reply == Reply::exception) {
    answered_.store(true, relaxed);
    last_reply_ns_ = now_ns();
  }
  if (reply == Reply::good) {
    counters_.replies.fetch_add(1, relaxed);
    return true;
  }
  const RequestRange range = range_of(plan, writes);
  std::string fault = text_of(range, map_) + ": " + session_.fault();
  if (reply == Reply::exception) {
    counters_.replies.fetch_add(1, relaxed);
    counters_.exceptions.add(session_.exception_code(), range);
    counters_.errors.fetch_add(1, relaxed);
    if (cycle_fault_.empty() && !refused_for_its_gaps(reply, plan)) cycle_fault_ = std::move(fault);
    return true;
  }
  (reply == Reply::timeout ? counters_.timeouts : counters_.errors).fetch_add(1, relaxed);
  lose_connection(fault);
  return false;
}

RunTimeNs ClientDevice::now_ns() const noexcept {
  return pacing_ == Pacing::lockstep ? wanted_tick_ns_ : clock_->now_ns();
}

bool ClientDevice::connected() const noexcept {
  return connected_.load(relaxed) && !is_stalled();
}

bool ClientDevice::is_stalled() const noexcept {
  if (pacing_ == Pacing::lockstep || clock_ == nullptr) return false;
  const auto since_ns = cycle_watch_.waits_since();
  return since_ns && clock_->now_ns() - *since_ns > loss_timeout_ns();
}

ClientDevice::CycleLimit ClientDevice::limit_from_now(std::chrono::milliseconds length) {
  return {WallClock::now() + length, length};
}

TimeLimit ClientDevice::request_limit(const CycleLimit& limit) const {
  if (limit.until != WallTime::max()) {
    const auto left = std::chrono::floor<std::chrono::microseconds>(limit.until - WallClock::now());
    if (left < settings_.response_timeout)
      return {std::max(left, std::chrono::microseconds(1)), limit.length};
  }
  return {settings_.response_timeout, settings_.response_timeout};
}

void ClientDevice::lose_connection(const std::string& fault) {
  session_.disconnect();
  connected_.store(false, relaxed);
  next_connect_ = WallClock::now() + reconnect_pause_;
  reconnect_pause_ = std::min(2 * reconnect_pause_, settings_.reconnect_pause_max);
  set_fault(fault);
}

void ClientDevice::set_fault(const std::string& fault) {
  const std::scoped_lock lock(health_mutex_);
  fault_ = fault.empty() ? "" : description_ + ": " + fault;
}

std::string ClientDevice::send_fault() const {
  const std::scoped_lock lock(health_mutex_);
  return send_fault_;
}

std::string ClientDevice::fault() const {
  const std::scoped_lock lock(health_mutex_);
  if (!fault_.empty() || !is_stalled()) return fault_;
  return description_ + ": no cycle has ended for more than " + std::to_string(settings_.max_age.count()) +
         " ms";
}

std::vector<DeviceEvent> ClientDevice::events_since(std::size_t first) const {
  if (clock_ == nullptr) return {};
  freshness_.report(inputs_, label_, "was not read", events_);
  return events_.since(first, *clock_);
}

ClientCounters ClientDevice::counters() const noexcept {
  ClientCounters counters = counters_.counts();
  counters.values = values_.counters();
  counters.stale_inputs = freshness_.stale();
  return counters;
}

}  // namespace hil::io::modbus
