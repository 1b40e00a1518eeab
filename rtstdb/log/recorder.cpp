#include "rtstdb/log/recorder.hpp"

#include <rtstdb/result.hpp>

namespace rtstdb::log {

bool Recorder::room_for(const store::WriteSet& set) const noexcept {
  return !in_gap() && ring_.room_for(commit_bytes(set), taken_back_bytes);
}

bool Recorder::record(const store::WriteSet& set) noexcept {
  const std::size_t bytes = commit_bytes(set);
  if (end_gap() && ring_.room_for(bytes, taken_back_bytes)) {
    encode_commit(set, ring_.reserve(bytes));
    commit();
    return true;
  }
  if (!in_gap()) gap_from_ = set.version;
  gap_to_ = set.version;
  gap_versions_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void Recorder::take_back(Version version) noexcept {
  if (in_gap()) return;  // the gap covers it
  const auto room = ring_.reserve(taken_back_bytes);
  RTSTDB_ASSERT(!room.empty());
  encode_taken_back(version, room);
  commit();
}

bool Recorder::record(const LoggedGeometry& geometry) noexcept {
  const std::size_t bytes = geometry_bytes(geometry);
  if (!end_gap() || !ring_.room_for(bytes, taken_back_bytes)) return false;
  encode_geometry(geometry, ring_.reserve(bytes));
  commit();
  return true;
}

void Recorder::tend() noexcept {
  end_gap();
}

bool Recorder::end_gap() noexcept {
  if (!in_gap()) return true;
  // Not at the first free bytes: a disk that is back has emptied the ring.
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
