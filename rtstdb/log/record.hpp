#pragma once
// What a log is made of, to bytes and back: a commit's write set, a geometry, a version that came to nothing, versions that are
// missing.
//
// Writing: the size is known beforehand, and the bytes go into room of exactly that size; nothing allocates, nothing can fail.
// Reading trusts nothing: lengths, kinds, reserved bytes and every value are checked, and what the writing side would not have
// written is refused.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <rtstdb/geometry.hpp>

#include "rtstdb/log/commit_record.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::log {

/// A geometry as the log knows it: its mesh lies in a file of its own.
struct LoggedGeometry {
  GeometryId id;
  std::string name;  ///< at most max_name_bytes
  GeometryOptions options;
  std::uint64_t file = 0;
  std::uint64_t file_checksum = 0;
};

std::size_t geometry_bytes(const LoggedGeometry& geometry) noexcept;
void encode_geometry(const LoggedGeometry& geometry, std::span<std::byte> room) noexcept;

inline constexpr std::size_t taken_back_bytes = sizeof(RecordHeader) + sizeof(TakenBackBody);
void encode_taken_back(Version version, std::span<std::byte> room) noexcept;

inline constexpr std::size_t gap_bytes = sizeof(RecordHeader) + sizeof(GapBody);
void encode_gap(Version from, Version to, std::span<std::byte> room) noexcept;

/// One record. By kind, the rest is as it was.
struct Record {
  RecordKind kind = RecordKind::none;
  /// Commit, also where it is told as a move. Writes have what the record has: whole rows (create, update), of `row.motion` what is not unchanged (update_motion: World::apply
  /// completes it), the id (remove).
  store::WriteSet commit;
  LoggedGeometry geometry;
  Version version = 0;  ///< taken back; a gap's first
  Version to = 0;       ///< a gap's last
};

class RecordDecoder {
 public:
  /// Of the record before, where that is a commit or what a checkpoint holds.
  explicit RecordDecoder(std::optional<WorldTime> time_before = {}) : commits_(time_before) {}

  /// `bytes` begin with a record; the record stays until the next call. What is wrong, or null.
  [[nodiscard]] const char* decode(std::span<const std::byte> bytes);
  Record& record() noexcept { return record_; }
  /// Of the record that was decoded, or refused for something behind its header.
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  const char* decode_geometry(std::span<const std::byte> body);

  Record record_;
  std::size_t bytes_ = 0;
  CommitDecoder commits_;
};

// ---- parts that checkpoints have too

std::size_t stored_geometry_bytes(const LoggedGeometry& geometry) noexcept;
void put_geometry(class ByteWriter& writer, const LoggedGeometry& geometry) noexcept;
[[nodiscard]] const char* get_geometry(class ByteReader& reader, LoggedGeometry& geometry);

}  // namespace rtstdb::log
