#include "rtstdb/query/chunked_run.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::query {
namespace {

/// A retried element takes about as long as this many elements in groups.
constexpr std::uint32_t alone_is_worth = 8;

/// The time of a dispatch alone, about: it says nothing about the cost of elements.
constexpr double dispatch_ns = 100e3;

/// A chunk that was halted before any element was complete is followed by one with this many times fewer
/// elements.
constexpr std::uint32_t fewer_after_none = 8;

/// A chunk that is filled to this part takes no elements of the next request.
constexpr double nearly_full = 0.95;

}  // namespace

RunReport ChunkedRun::run() noexcept {
  const auto ended = [&](RunStatus status) {
    // What is still in flight writes into the queries' buffers.
    for (accel::Submit& lane : lanes_) {
      if (!lane.finish()) status = RunStatus::device_lost;
      gpu_ns_ += lane.take_gpu_ns();
    }
    return RunReport{.status = status, .gpu_ns = gpu_ns_};
  };
  // The time of earlier submissions is not this run's.
  for (accel::Submit& lane : lanes_)
    lane.take_gpu_ns();
  if (!bring_up(lanes_[0])) return ended(RunStatus::device_lost);
  bool truncated = false;
  for (const Request& request : requests_)
    static_cast<GpuQuery*>(request.query)->begin_batch(request.count, world());
  while (true) {
    if (const auto status = run_pass(Pass::all)) return ended(*status);
    if (const auto status = next_retry_batch()) return ended(*status);
    if (!begin_next_stage()) break;
    if (const auto status = preemption_point_between_passes()) return ended(*status);
  }
  for (std::size_t k = 0; k < requests_.size(); ++k)
    truncated = truncated || query(k).truncated();
  return ended(truncated ? RunStatus::truncated : RunStatus::done);
}

bool ChunkedRun::bring_up(accel::Submit& lane) noexcept {
  if (!structures_.pool.show(structures_.device, rows_, lane)) return false;
  lane.begin();
  recording_begun_ = true;
  std::uint64_t elements = 0;
  for (const Request& request : requests_)
    elements += request.count;
  const auto view = structures_.tlas.prepare(
      rows_, {.times = times_, .elements = elements, .shapes = structures_.pool.shown(), .slot = slot_},
      lane);
  if (!view) return false;
  records_structure_work_ = view->contents != view_.contents;
  view_ = *view;
  slot_ = view_.slot;
  return true;
}

// One round of the loop starts chunk n on lane n % 2 and then completes chunk n - 1 on the other lane:
//
//   device             | chunk 0       | chunk 1                           | chunk 2 ...
//   lane               | 0             | 1                                 | 0
//   host    start 0, 1 | wait for 0    | unpack 0, preemption point,       | unpack 1, ...
//                                        start 2, wait for 1
//
// A halt of chunk n - 1 ends chunk n with it; the answers of chunk n are discarded, and the next chunk begins
// with the first element that chunk n - 1 did not start. A nested run at the preemption point may halt chunk
// n; the next round then completes what is left of it first, and goes on behind it.
std::optional<RunStatus> ChunkedRun::run_pass(Pass pass) noexcept {
  Cursor next;
  pass_over(next, pass);
  // Without elements the recorded structure work is submitted alone.
  if (at_end(next) && std::exchange(recording_begun_, false) && !lanes_[0].run())
    return RunStatus::device_lost;
  std::optional<Chunk> in_flight;
  for (std::uint32_t number = 0; in_flight || !at_end(next); ++number) {
    accel::Submit& lane = lanes_[number % 2];
    accel::Submit& previous_lane = lanes_[(number + 1) % 2];
    std::optional<Chunk> previous = std::exchange(in_flight, std::nullopt);
    if (previous && previous_lane.first_unstarted() < previous->elements) {
      // A nested run has halted it: the next chunk begins with what it left.
      if (!finish(previous_lane, *previous, pass, nullptr)) return RunStatus::device_lost;
      unpack(*previous, pass);
      next = std::exchange(previous, std::nullopt)->end;
    }
    if (!at_end(next)) {
      if (!std::exchange(recording_begun_, false)) lane.begin();
      in_flight = take(next, pass);
      if (std::exchange(records_structure_work_, false)) in_flight->predicted_ns = 0.0;
      record(*in_flight, pass, lane);
      if (!lane.start({.halt_after = halt_after_, .early = may_halt_early()})) return RunStatus::device_lost;
    }
    if (!previous) continue;
    if (!finish(previous_lane, *previous, pass, in_flight ? &lane : nullptr)) return RunStatus::device_lost;
    unpack(*previous, pass);
    if (previous->halted) {
      // The chunk behind it is halted too, and its elements are executed again.
      if (std::exchange(in_flight, std::nullopt)) {
        if (!lane.finish()) return RunStatus::device_lost;
        const std::int64_t took_ns = lane.take_gpu_ns();
        gpu_ns_ += took_ns;
        repeated_ns_ += took_ns;
      }
      next = previous->end;
    }
    if (!in_flight && at_end(next)) break;
    if (const auto ended = preemption_point(previous_lane, !at_end(next), lane, in_flight, pass))
      return ended;
  }
  return std::nullopt;
}

bool ChunkedRun::finish(accel::Submit& lane, Chunk& chunk, Pass pass, accel::Submit* behind) noexcept {
  if (!lane.finish(false, behind)) return false;
  const std::int64_t took_ns = lane.take_gpu_ns();
  gpu_ns_ += took_ns;
  if (const std::uint32_t submitted = chunk.elements; lane.first_unstarted() < submitted) {
    cut(chunk, lane.first_unstarted(), pass);
    const auto worth_ns = static_cast<std::int64_t>(chunk.elements * element_ns_);
    if (chunk.elements == 0 || lane.halted_early())
      repeated_ns_ += std::max(took_ns - worth_ns, std::int64_t{0});
    // How much was complete says nothing about the elements.
    if (lane.halted_early()) return true;
    follow_halt(chunk, submitted);
  } else {
    element_ns_ = static_cast<double>(took_ns) / std::max(submitted, 1u);
    halt_after_ = usual_halt_after();
  }
  if (chunk.predicted_ns > 0.0)
    update_estimates(chunk, static_cast<double>(took_ns), lane.completed_before_wait(), pass);
  return true;
}

void ChunkedRun::cut(Chunk& chunk, std::uint32_t first_unstarted, Pass pass) noexcept {
  Cursor at = chunk.begin;
  std::uint32_t before = 0;
  for (PlaceRange range = part(chunk, at.request, pass);
       first_unstarted >= before + (range.end - range.first); range = part(chunk, at.request, pass)) {
    before += range.end - range.first;
    at = {at.request + 1, 0};
  }
  // Neighbours stay together; retried elements are alone.
  const std::uint32_t step = pass == Pass::all ? neighbours : 1;
  const std::uint32_t answered = (first_unstarted - before) / step * step;
  at.element += answered;
  const std::uint32_t elements = before + answered;
  chunk.predicted_ns *= static_cast<double>(elements) / chunk.elements;
  chunk.elements = elements;
  chunk.end = at;
  chunk.halted = true;
}

void ChunkedRun::follow_halt(const Chunk& chunk, std::uint32_t submitted) noexcept {
  halt_after_ = chunk.elements == 0 ? 2 * halt_after_ : usual_halt_after();
  if (chunk.elements > 0) return;
  if (per_chunk(chunk.end.request, Pass::all) > 0)
    pace_.begin_with(pace_.relative_size() / fewer_after_none);
  else
    undivided_per_chunk_ = std::max(submitted / fewer_after_none, 1u);
}

void ChunkedRun::update_estimates(const Chunk& chunk, double took_ns, bool completed_before_wait,
                                  Pass pass) noexcept {
  const std::size_t request = chunk.begin.request;
  if (request >= measured_requests_) {
    pace_.begin_with(requests_[request].initial_chunk_fraction);
    measured_requests_ = request + 1;
  }
  pace_.update({chunk.predicted_ns, took_ns, completed_before_wait});
  const bool is_short = took_ns <= static_cast<double>(requests_[request].chunk_time.count());
  if (pass == Pass::again || completed_before_wait || is_short) return;
  const double worst_cost_ratio = (took_ns - dispatch_ns) / chunk.predicted_ns;
  each_part(chunk, pass, [&](GpuQuery& query, PlaceRange) {
    query.worst_cost_ratio = std::max(query.worst_cost_ratio, worst_cost_ratio);
  });
}

ExecutorCallbacks::Continuation ChunkedRun::offer_preemption_point(Pass pass) noexcept {
  // Paused searches, and stages that build on earlier ones, would begin again in a slot that another run has
  // rebuilt.
  const bool keeps_structures = pass == Pass::again || in_later_stage_;
  const bool slot_stays = keeps_structures && structures_.tlas.pin(view_.slot);
  const bool shapes_stay = keeps_structures && structures_.pool.pin(rows_);
  const ExecutorCallbacks::Continuation continuation = callbacks_->on_preemption_point();
  if (shapes_stay) structures_.pool.unpin(rows_);
  if (slot_stays) structures_.tlas.unpin(view_.slot);
  return continuation;
}

std::optional<RunStatus> ChunkedRun::next_retry_batch() noexcept {
  pace_ = ChunkPace(chunk_ns());
  while (true) {
    bool some = false;
    for (std::size_t k = 0; k < requests_.size(); ++k) {
      query(k).retry_batch = query(k).next_retry_batch();
      some = some || query(k).retry_batch > 0;
    }
    if (!some) return std::nullopt;
    if (const auto status = preemption_point_between_passes()) return status;
    measured_requests_ = 0;
    if (const auto status = run_pass(Pass::again)) return status;
  }
}

bool ChunkedRun::begin_next_stage() noexcept {
  bool some = false;
  for (std::size_t k = 0; k < requests_.size(); ++k)
    some = query(k).begin_next_stage(world()) || some;
  in_later_stage_ = some;
  pace_ = ChunkPace(chunk_ns());
  measured_requests_ = 0;
  return some;
}

std::optional<RunStatus> ChunkedRun::preemption_point_between_passes() noexcept {
  if (callbacks_ == nullptr) return std::nullopt;
  const std::uint64_t runs = structures_.runs;
  switch (offer_preemption_point(Pass::again)) {
    case ExecutorCallbacks::Continuation::stop:
      return RunStatus::stopped;
    case ExecutorCallbacks::Continuation::finish_in_flight:
      return RunStatus::partial;
    case ExecutorCallbacks::Continuation::go_on:
      break;
  }
  if (structures_.runs != runs && !bring_up(lanes_[0])) return RunStatus::device_lost;
  return std::nullopt;
}

std::optional<RunStatus> ChunkedRun::preemption_point(accel::Submit& next_lane, bool has_next,
                                                      accel::Submit& lane_in_flight,
                                                      std::optional<Chunk>& in_flight, Pass pass) noexcept {
  if (callbacks_ == nullptr) return std::nullopt;
  const std::uint64_t runs = structures_.runs;
  switch (offer_preemption_point(pass)) {
    case ExecutorCallbacks::Continuation::stop:
      return RunStatus::stopped;
    case ExecutorCallbacks::Continuation::finish_in_flight:
      // A nested run may have brought the slot to another version: then the hits in flight can not be
      // resolved any more.
      if (structures_.runs != runs || !in_flight) return RunStatus::partial;
      if (!finish(lane_in_flight, *in_flight, pass, nullptr)) return RunStatus::device_lost;
      unpack(*in_flight, pass);
      return RunStatus::partial;
    case ExecutorCallbacks::Continuation::go_on:
      break;
  }
  if (structures_.runs == runs) return std::nullopt;
  if (!bring_up(next_lane)) return RunStatus::device_lost;
  // Structure work is submitted alone, so that the time of the next chunk is its own.
  if (has_next && !std::exchange(records_structure_work_, false)) return std::nullopt;
  recording_begun_ = false;
  const bool is_up = next_lane.run();
  gpu_ns_ += next_lane.take_gpu_ns();
  return is_up ? std::nullopt : std::optional(RunStatus::device_lost);
}

void ChunkedRun::pass_over(Cursor& next, Pass pass) const noexcept {
  while (!at_end(next) && next.element == total(next.request, pass))
    next = {next.request + 1, 0};
}

ChunkedRun::Chunk ChunkedRun::take(Cursor& next, Pass pass) const noexcept {
  Chunk chunk{next, next};
  double filled = 0.0;
  while (!at_end(next) && filled < nearly_full) {
    const std::uint32_t left = total(next.request, pass) - next.element;
    const double predicted_per_chunk = per_chunk(next.request, pass);
    const double most = share(next.request) * predicted_per_chunk;
    const double space = std::ceil((1.0 - filled) * most);
    std::uint32_t taken = left;
    if (most > 0.0 && space < left) {
      taken = std::min(at_least(static_cast<std::uint32_t>(space), next.request, pass), left);
      filled = 1.0;
    } else if (most > 0.0) {
      filled += taken / most;
    }
    if (most > 0.0)
      chunk.predicted_ns +=
          taken / predicted_per_chunk * static_cast<double>(requests_[next.request].chunk_time.count());
    next.element += taken;
    chunk.elements += taken;
    chunk.end = next;
    pass_over(next, pass);
  }
  return chunk;
}

std::uint32_t ChunkedRun::at_least(std::uint32_t elements, std::size_t request, Pass pass) const noexcept {
  if (pass == Pass::again) return std::max(elements, query(request).min_retry_batch());
  const std::uint32_t step = min_places(structures_.device.limits().processors);
  return (elements + step - 1) / step * step;
}

std::uint32_t ChunkedRun::total(std::size_t request, Pass pass) const noexcept {
  return pass == Pass::all ? query(request).places() : query(request).retry_batch;
}

std::uint32_t ChunkedRun::per_chunk(std::size_t request, Pass pass) const noexcept {
  if (callbacks_ == nullptr) return 0;
  const double places = requests_[request].per_chunk * query(request).places_per_element();
  const auto predicted = static_cast<std::uint32_t>(std::min(places, 4e9));
  const std::uint32_t most = predicted > 0 ? predicted : undivided_per_chunk_;
  return pass == Pass::all || most == 0 ? most
                                        : std::max(query(request).min_retry_batch(), most / alone_is_worth);
}

double ChunkedRun::share(std::size_t request) const noexcept {
  return request < measured_requests_
             ? pace_.relative_size()
             : std::min(pace_.relative_size(), requests_[request].initial_chunk_fraction);
}

PlaceRange ChunkedRun::part(const Chunk& chunk, std::size_t request, Pass pass) const noexcept {
  return {request == chunk.begin.request ? chunk.begin.element : 0,
          request == chunk.end.request ? chunk.end.element : total(request, pass)};
}

template <class Each>
void ChunkedRun::each_part(const Chunk& chunk, Pass pass, Each each) noexcept {
  for (std::size_t k = chunk.begin.request; k <= chunk.end.request; ++k) {
    const PlaceRange range = part(chunk, k, pass);
    if (range.first < range.end) each(query(k), range);
  }
}

void ChunkedRun::record(const Chunk& chunk, Pass pass, accel::Submit& lane) noexcept {
  std::uint32_t before = 0;
  each_part(chunk, pass, [&](GpuQuery& query, PlaceRange range) {
    const HaltAt halt{.words = lane.halt_address(), .from = before - range.first};
    query.record({range, pass == Pass::again, query.stage()}, {.rows = rows_,
                                                               .pool = structures_.pool,
                                                               .tlas = structures_.tlas,
                                                               .view = view_,
                                                               .halt = halt,
                                                               .recorder = lane.recorder()});
    before += range.end - range.first;
  });
}

void ChunkedRun::unpack(const Chunk& chunk, Pass pass) noexcept {
  each_part(chunk, pass, [&](GpuQuery& query, PlaceRange range) {
    query.take_answers({range, pass == Pass::again, query.stage()}, view_);
  });
}

}  // namespace rtstdb::query
