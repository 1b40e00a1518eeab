#include "rtstdb/log/recorder.hpp"

#include <algorithm>
#include <cstring>

#include <rtstdb/result.hpp>

namespace rtstdb::log {
namespace {

/// Enough for a few commits of one row.
constexpr std::size_t max_collected_bytes = 2048;

}  // namespace

Recorder::Recorder(Ring& ring)
    : ring_(ring), collected_(std::min(max_collected_bytes, ring.capacity() / 16 / 8 * 8)) {}

bool Recorder::room_for(const store::WriteSet& set) const noexcept {
  return !in_gap() && ring_.room_for(collected_bytes_ + max_commit_bytes(set), taken_back_bytes);
}

bool Recorder::room_for(const LoggedGeometry& geometry) const noexcept {
  return !in_gap() && ring_.room_for(collected_bytes_ + geometry_bytes(geometry), taken_back_bytes);
}

bool Recorder::collect(const store::WriteSet& set) noexcept {
  const CommitForm form = form_of(set, time_before_);
  if (form.bytes > collected_.size() - collected_bytes_) return false;
  if (in_gap() || !ring_.room_for(collected_bytes_ + form.bytes, taken_back_bytes)) return false;
  encode_commit(set, form, std::span(collected_).subspan(collected_bytes_, form.bytes));
  collected_bytes_ += form.bytes;
  time_before_ = set.time;
  ++records_;
  return true;
}

bool Recorder::hand_over() noexcept {
  if (collected_bytes_ == 0) return false;
  const auto room = ring_.reserve(collected_bytes_);
  RTSTDB_ASSERT(!room.empty());  // collect() checked it
  std::memcpy(room.data(), collected_.data(), collected_bytes_);
  ring_.commit();
  collected_bytes_ = 0;
  return true;
}

bool Recorder::record(const store::WriteSet& set) noexcept {
  hand_over();
  const CommitForm form = form_of(set, time_before_);
  if (end_gap() && ring_.room_for(form.bytes, taken_back_bytes)) {
    encode_commit(set, form, ring_.reserve(form.bytes));
    commit();
    time_before_ = set.time;
    return true;
  }
  if (!in_gap()) gap_from_ = set.version;
  time_before_.reset();
  gap_to_ = set.version;
  gap_versions_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void Recorder::take_back(Version version) noexcept {
  if (in_gap()) return;  // the version is in the gap
  hand_over();
  const auto room = ring_.reserve(taken_back_bytes);
  RTSTDB_ASSERT(!room.empty());
  encode_taken_back(version, room);
  commit();
  time_before_.reset();
}

bool Recorder::record(const LoggedGeometry& geometry) noexcept {
  hand_over();
  const std::size_t bytes = geometry_bytes(geometry);
  if (!end_gap() || !ring_.room_for(bytes, taken_back_bytes)) return false;
  encode_geometry(geometry, ring_.reserve(bytes));
  commit();
  return true;
}

void Recorder::tend() noexcept {
  hand_over();
  end_gap();
}

bool Recorder::end_gap() noexcept {
  if (!in_gap()) return true;
  // Half of the ring must be free, since a gap that ends in a nearly full ring would be followed by another
  // one.
  if (ring_.used() > ring_.capacity() / 2 || !ring_.room_for(gap_bytes, taken_back_bytes)) return false;
  encode_gap(gap_from_, gap_to_, ring_.reserve(gap_bytes));
  commit();
  gap_from_ = gap_to_ = 0;
  return true;
}

void Recorder::commit() noexcept {
  ring_.commit();
  ++records_;
}

}  // namespace rtstdb::log
