#include "rtstdb/log/record.hpp"

#include <type_traits>

#include <rtstdb/limits.hpp>

#include "rtstdb/log/bytes.hpp"

namespace rtstdb::log {
namespace {

void put_header(ByteWriter& writer, RecordKind kind, std::span<std::byte> space) noexcept {
  RTSTDB_ASSERT(space.size() <= max_record_bytes, "the record is above max_record_bytes");
  writer.put(RecordHeader{.kind = kind, .bytes = static_cast<std::uint32_t>(space.size())});
}

}  // namespace

// ---- geometries

std::size_t stored_geometry_bytes(const LoggedGeometry& geometry) noexcept {
  return sizeof(StoredGeometry) + round_up(geometry.name.size(), 8);
}

void put_geometry(ByteWriter& writer, const LoggedGeometry& geometry) noexcept {
  RTSTDB_ASSERT(geometry.name.size() <= max_name_bytes, "the name is longer than max_name_bytes");
  const GeometryOptions& options = geometry.options;
  writer.put(StoredGeometry{geometry.file, geometry.file_checksum, geometry.id.index,
                            options.deforms ? 1u : 0u, options.retained_shapes, options.rebuild_growth,
                            static_cast<std::uint32_t>(geometry.name.size()), 0});
  writer.put_bytes(std::as_bytes(std::span(geometry.name)));
  writer.pad_to(8);
}

const char* get_geometry(ByteReader& reader, LoggedGeometry& geometry) {
  StoredGeometry stored_geometry;
  if (!reader.get(stored_geometry)) return "a geometry is cut short";
  if (stored_geometry.index >= max_geometries) return "a geometry's index is beyond the limit";
  if (stored_geometry.deforms > 1 || stored_geometry.reserved != 0 || stored_geometry.file == 0)
    return "a geometry has invalid values";
  geometry.id = {stored_geometry.index};
  geometry.file = stored_geometry.file;
  geometry.file_checksum = stored_geometry.file_checksum;
  geometry.options = {stored_geometry.deforms == 1, stored_geometry.retained_shapes,
                      stored_geometry.rebuild_growth};
  const bool options_possible = stored_geometry.retained_shapes >= 1 &&
                                stored_geometry.retained_shapes <= max_retained_shapes &&
                                stored_geometry.rebuild_growth >= 1.0f;
  if (geometry.options.deforms && !options_possible) return "a geometry has invalid options";
  if (stored_geometry.name_bytes > max_name_bytes) return "a geometry's name is too long";
  std::span<const std::byte> name;
  if (!reader.get_bytes(stored_geometry.name_bytes, name)) return "a geometry's name is cut short";
  geometry.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  return reader.skip_padding(8) ? nullptr : "a geometry's name is not padded with zeros";
}

std::size_t geometry_bytes(const LoggedGeometry& geometry) noexcept {
  return sizeof(RecordHeader) + stored_geometry_bytes(geometry);
}

void encode_geometry(const LoggedGeometry& geometry, std::span<std::byte> space) noexcept {
  ByteWriter writer(space);
  put_header(writer, RecordKind::geometry, space);
  put_geometry(writer, geometry);
  RTSTDB_ASSERT(writer.count() == space.size(), "the record does not fill its space");
}

const char* RecordDecoder::decode_geometry(std::span<const std::byte> body) {
  ByteReader reader(body);
  if (const char* fault = get_geometry(reader, record_.geometry)) return fault;
  return reader.left() == 0 ? nullptr : "a geometry has extra bytes";
}

// ---- materials and lights

template <class Value>
std::size_t definition_bytes(const LoggedDefinition<Value>& definition) noexcept {
  return sizeof(RecordHeader) + stored_definition_bytes(definition);
}

template <class Value>
void encode_definition(const LoggedDefinition<Value>& definition, std::span<std::byte> space) noexcept {
  ByteWriter writer(space);
  put_header(writer, std::is_same_v<Value, Material> ? RecordKind::material : RecordKind::light, space);
  put_definition(writer, definition);
  RTSTDB_ASSERT(writer.count() == space.size(), "the record does not fill its space");
}

template std::size_t definition_bytes(const LoggedMaterial&) noexcept;
template std::size_t definition_bytes(const LoggedLight&) noexcept;
template void encode_definition(const LoggedMaterial&, std::span<std::byte>) noexcept;
template void encode_definition(const LoggedLight&, std::span<std::byte>) noexcept;

template <class Value>
const char* RecordDecoder::decode_definition(std::span<const std::byte> body,
                                             LoggedDefinition<Value>& definition) {
  ByteReader reader(body);
  if (const char* fault = get_definition(reader, definition)) return fault;
  return reader.left() == 0 ? nullptr : "a material or a light has extra bytes";
}

// ---- versions discarded, gaps

void encode_discard(Version version, std::span<std::byte> space) noexcept {
  ByteWriter writer(space);
  put_header(writer, RecordKind::discarded, space);
  writer.put(DiscardBody{version});
}

void encode_gap(Version from, Version to, std::span<std::byte> space) noexcept {
  ByteWriter writer(space);
  put_header(writer, RecordKind::gap, space);
  writer.put(GapBody{from, to});
}

const char* RecordDecoder::decode(std::span<const std::byte> bytes) {
  bytes_ = 0;
  ByteReader reader(bytes);
  RecordHeader header;
  if (!reader.get(header)) return "a record is cut short";
  if (header.bytes < sizeof header || header.bytes > max_record_bytes || header.bytes % 8 != 0 ||
      header.bytes > bytes.size())
    return "a record has an invalid length";
  bytes_ = header.bytes;
  record_.kind = header.kind;
  const auto body = bytes.first(header.bytes).subspan(sizeof header);
  if (header.omitted_words != 0 && header.kind != RecordKind::move)
    return "a record other than a move omits words";
  switch (header.kind) {
    case RecordKind::commit:
      return commits_.decode_commit(body, record_.commit);
    case RecordKind::move:
      record_.kind = RecordKind::commit;
      return commits_.decode_move(header.omitted_words, body, record_.commit);
    case RecordKind::geometry:
      return decode_geometry(body);
    case RecordKind::material:
      return decode_definition(body, record_.material);
    case RecordKind::light:
      return decode_definition(body, record_.light);
    case RecordKind::discarded: {
      commits_.forget_time();
      DiscardBody discarded;
      if (body.size() != sizeof discarded || !reader.get(discarded)) return "a record is cut short";
      record_.version = discarded.version;
      return discarded.version != 0 ? nullptr : "a discard record has no version";
    }
    case RecordKind::gap: {
      commits_.forget_time();
      GapBody gap;
      if (body.size() != sizeof gap || !reader.get(gap)) return "a record is cut short";
      record_.version = gap.from;
      record_.to = gap.to;
      return gap.from != 0 && gap.from <= gap.to ? nullptr : "a gap ends before it begins";
    }
    default:
      return "a record has an unknown kind";
  }
}

}  // namespace rtstdb::log
