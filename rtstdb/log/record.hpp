#pragma once
// Encodes and decodes the records of a log: the write set of a commit, a geometry, a material, a light, a
// version that was taken back, a gap.
//
// Encoding: the size is known in advance, and the room has exactly that size; it neither allocates nor fails.
// Decoding trusts nothing: lengths, kinds, reserved bytes and all values are checked, and anything that the
// encoding would not produce is refused.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include <rtstdb/geometry.hpp>

#include "rtstdb/log/commit_record.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log/stored_definition.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::log {

/// A geometry in the log. Its mesh is in a separate file.
struct LoggedGeometry {
  GeometryId id;
  std::string name;  ///< at most max_name_bytes
  GeometryOptions options;
  std::uint64_t file = 0;
  std::uint64_t file_checksum = 0;
};

/// What the file of a geometry holds.
struct StoredMesh : TriangleMesh {
  ConvexPartPoints convex_parts_m{};  ///< GeometryOptions::convex_parts_m
  std::optional<Solid> solid{};       ///< GeometryOptions::solid
};

std::size_t geometry_bytes(const LoggedGeometry& geometry) noexcept;
void encode_geometry(const LoggedGeometry& geometry, std::span<std::byte> space) noexcept;

// For materials and lights.
template <class Value>
std::size_t definition_bytes(const LoggedDefinition<Value>& definition) noexcept;
template <class Value>
void encode_definition(const LoggedDefinition<Value>& definition, std::span<std::byte> space) noexcept;

inline constexpr std::size_t discard_bytes = sizeof(RecordHeader) + sizeof(DiscardBody);
void encode_discard(Version version, std::span<std::byte> space) noexcept;

inline constexpr std::size_t gap_bytes = sizeof(RecordHeader) + sizeof(GapBody);
void encode_gap(Version from, Version to, std::span<std::byte> space) noexcept;

/// A decoded record. Members of other kinds keep their previous values.
struct Record {
  RecordKind kind = RecordKind::none;
  /// Commit, from a commit record or a move record. Its writes have what the record holds: the whole row
  /// (create, update), the words of `row.motion` that are not omitted (update_motion; World::apply completes
  /// them), the id (remove).
  store::WriteSet commit;
  LoggedGeometry geometry;
  LoggedMaterial material;
  LoggedLight light;
  Version version = 0;  ///< the version discarded; the first version of a gap
  Version to = 0;       ///< the last version of a gap
};

class RecordDecoder {
 public:
  /// `previous_time`: world time of the previous commit, or of the checkpoint.
  explicit RecordDecoder(std::optional<WorldTime> previous_time = {}) : commits_(previous_time) {}

  /// Decodes the record at the beginning of `bytes`; it is valid until the next call. Returns a description
  /// of the fault, or null.
  [[nodiscard]] const char* decode(std::span<const std::byte> bytes);
  Record& record() noexcept { return record_; }
  /// Length of the decoded record, also if it was refused for its body.
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  const char* decode_geometry(std::span<const std::byte> body);
  template <class Value>
  const char* decode_definition(std::span<const std::byte> body, LoggedDefinition<Value>& definition);

  Record record_;
  std::size_t bytes_ = 0;
  CommitDecoder commits_;
};

// ---- shared with checkpoints

std::size_t stored_geometry_bytes(const LoggedGeometry& geometry) noexcept;
void put_geometry(class ByteWriter& writer, const LoggedGeometry& geometry) noexcept;
[[nodiscard]] const char* get_geometry(class ByteReader& reader, LoggedGeometry& geometry);

}  // namespace rtstdb::log
