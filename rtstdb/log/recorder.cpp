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

bool Recorder::has_space_for(const store::WriteSet& set) const noexcept {
  return !in_gap() && ring_.has_space_for(collected_bytes_ + max_commit_bytes(set), discard_bytes);
}

bool Recorder::has_space_for(const LoggedGeometry& geometry) const noexcept {
  return !in_gap() && ring_.has_space_for(collected_bytes_ + geometry_bytes(geometry), discard_bytes);
}

bool Recorder::has_space_for(const LoggedMaterial& material) const noexcept {
  return !in_gap() && ring_.has_space_for(collected_bytes_ + material_bytes(material), discard_bytes);
}

bool Recorder::collect(const store::WriteSet& set) noexcept {
  const CommitEncoding form = encoding_of(set, previous_time_);
  if (form.bytes > collected_.size() - collected_bytes_) return false;
  if (in_gap() || !ring_.has_space_for(collected_bytes_ + form.bytes, discard_bytes)) return false;
  encode_commit(set, form, std::span(collected_).subspan(collected_bytes_, form.bytes));
  collected_bytes_ += form.bytes;
  previous_time_ = set.time;
  ++records_;
  return true;
}

bool Recorder::flush() noexcept {
  if (collected_bytes_ == 0) return false;
  const auto space = ring_.reserve(collected_bytes_);
  RTSTDB_ASSERT(!space.empty());  // collect() checked it
  std::memcpy(space.data(), collected_.data(), collected_bytes_);
  ring_.commit();
  collected_bytes_ = 0;
  return true;
}

bool Recorder::record(const store::WriteSet& set) noexcept {
  flush();
  const CommitEncoding form = encoding_of(set, previous_time_);
  if (end_gap() && ring_.has_space_for(form.bytes, discard_bytes)) {
    encode_commit(set, form, ring_.reserve(form.bytes));
    commit();
    previous_time_ = set.time;
    return true;
  }
  if (!in_gap()) gap_from_ = set.version;
  previous_time_.reset();
  gap_to_ = set.version;
  gap_versions_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

void Recorder::discard(Version version) noexcept {
  if (in_gap()) return;  // the version is in the gap
  flush();
  const auto space = ring_.reserve(discard_bytes);
  RTSTDB_ASSERT(!space.empty());
  encode_discard(version, space);
  commit();
  previous_time_.reset();
}

bool Recorder::record(const LoggedGeometry& geometry) noexcept {
  flush();
  const std::size_t bytes = geometry_bytes(geometry);
  if (!end_gap() || !ring_.has_space_for(bytes, discard_bytes)) return false;
  encode_geometry(geometry, ring_.reserve(bytes));
  commit();
  return true;
}

bool Recorder::record(const LoggedMaterial& material) noexcept {
  flush();
  const std::size_t bytes = material_bytes(material);
  if (!end_gap() || !ring_.has_space_for(bytes, discard_bytes)) return false;
  encode_material(material, ring_.reserve(bytes));
  commit();
  return true;
}

void Recorder::maintain() noexcept {
  flush();
  end_gap();
}

bool Recorder::end_gap() noexcept {
  if (!in_gap()) return true;
  // Half of the ring must be free, since a gap that ends in a nearly full ring would be followed by another
  // one.
  if (ring_.used() > ring_.capacity() / 2 || !ring_.has_space_for(gap_bytes, discard_bytes)) return false;
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
