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

bool Recorder::has_space_for_bytes(std::size_t bytes) const noexcept {
  return !in_gap() && ring_.has_space_for(collected_bytes_ + bytes, discard_bytes);
}

bool Recorder::has_space_for(const store::WriteSet& set) const noexcept {
  return has_space_for_bytes(max_commit_bytes(set));
}

bool Recorder::has_space_for(const LoggedGeometry& geometry) const noexcept {
  return has_space_for_bytes(geometry_bytes(geometry));
}

bool Recorder::has_space_for(const LoggedMaterial& material) const noexcept {
  return has_space_for_bytes(definition_bytes(material));
}

bool Recorder::has_space_for(const LoggedLight& light) const noexcept {
  return has_space_for_bytes(definition_bytes(light));
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
  RTSTDB_ASSERT(!space.empty(), "the ring has no space, which collect() checks");
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
  RTSTDB_ASSERT(!space.empty(), "the ring has no space for a discard");
  encode_discard(version, space);
  commit();
  previous_time_.reset();
}

template <class Encode>
bool Recorder::record_bytes(std::size_t bytes, const Encode& encode) noexcept {
  flush();
  if (!end_gap() || !ring_.has_space_for(bytes, discard_bytes)) return false;
  encode(ring_.reserve(bytes));
  commit();
  return true;
}

bool Recorder::record(const LoggedGeometry& geometry) noexcept {
  return record_bytes(geometry_bytes(geometry),
                      [&](std::span<std::byte> space) { encode_geometry(geometry, space); });
}

bool Recorder::record(const LoggedMaterial& material) noexcept {
  return record_bytes(definition_bytes(material),
                      [&](std::span<std::byte> space) { encode_definition(material, space); });
}

bool Recorder::record(const LoggedLight& light) noexcept {
  return record_bytes(definition_bytes(light),
                      [&](std::span<std::byte> space) { encode_definition(light, space); });
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
