#include "rtstdb/log/segment_chain.hpp"

#include <algorithm>
#include <optional>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/directory.hpp"

namespace rtstdb::log {
namespace {

Error refuse(std::uint64_t segment, const std::string& found) {
  return {ErrorCode::file, segment_name(segment) + ": " + found};
}

std::string id_in_words(std::uint64_t id) {
  char text[32];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(id));
  return text;
}

struct FoundHeader {
  std::optional<SegmentHeader> header;
  std::string damage;  ///< why there is none
};

/// A segment gets its final name after its header is on disk, so a damaged header is damage and not a torn
/// write.
Result<FoundHeader> read_header(Disk& disk, std::uint64_t number) {
  auto file = disk.open(segment_name(number));
  if (!file) return Error{ErrorCode::file, file.error().describe()};
  SegmentHeader header;
  auto count = file.value()->read(0, std::as_writable_bytes(std::span(&header, 1)));
  if (!count) return Error{ErrorCode::file, count.error().describe()};
  if (count.value() != sizeof header || header.magic != segment_magic ||
      header.checksum != header_checksum(header, header.database_id))
    return FoundHeader{.header = {}, .damage = "its header is damaged"};
  if (header.format != format_version) return refuse(number, refused_format(header.format));
  // The file is a copy of another segment: the segment of this name is lost.
  if (header.number != number)
    return FoundHeader{.header = {}, .damage = "it is a copy of " + segment_name(header.number)};
  return FoundHeader{.header = header, .damage = {}};
}

/// The readable headers, newest first.
struct Headers {
  std::vector<SegmentHeader> readable;
  std::string damage;  ///< damage of a segment that is newer than all of them
};

Result<Headers> read_headers(Disk& disk, const std::vector<std::uint64_t>& segments) {
  Headers headers;
  for (auto number = segments.rbegin(); number != segments.rend(); ++number) {
    auto found = read_header(disk, *number);
    if (!found) return found.error();
    if (found.value().header) {
      headers.readable.push_back(*found.value().header);
    } else if (headers.readable.empty()) {
      headers.damage = segment_name(*number) + ": " + found.value().damage;
    }
  }
  return headers;
}

std::string missing_before(const SegmentChain& chain, const Position& from) {
  const std::string wanted = "group " + std::to_string(from.group);
  if (chain.links.empty()) {
    if (from.segment == 0) return "";
    return segment_name(from.segment) + " is missing, and " + wanted + " with it";
  }
  const SegmentHeader& first = chain.links.front().header;
  if (first.first_group > from.group)
    return segment_name(first.number) + " begins with group " + std::to_string(first.first_group) + ", and " +
           wanted + " is missing before it";
  if (first.number == from.segment) return "";
  // A later segment may have taken the place of the groups before, too.
  if (first.number < from.segment)
    return segment_name(from.segment) + " is missing, and " + wanted + " with it";
  if (first.first_group == from.group && first.link != from.link)
    return segment_name(first.number) + ": it does not follow the group before it";
  return "";
}

}  // namespace

Result<SegmentChain> find_chain(Disk& disk, const std::vector<std::uint64_t>& segments,
                                std::uint64_t database_id, const Position& from) {
  auto headers = read_headers(disk, segments);
  if (!headers) return headers.error();
  SegmentChain chain;
  const auto& readable = headers.value().readable;
  chain.database_id = database_id != 0 || readable.empty() ? database_id : readable.back().database_id;
  std::uint64_t end_group = no_limit;
  for (const SegmentHeader& header : readable) {
    if (header.database_id != chain.database_id)
      return refuse(header.number, "it belongs to database " + id_in_words(header.database_id) +
                                       ", and this is " + id_in_words(chain.database_id));
    if (header.first_group >= end_group || (!chain.links.empty() && end_group <= from.group)) continue;
    chain.links.push_back({header, end_group});
    end_group = header.first_group;
  }
  std::ranges::reverse(chain.links);
  chain.damage_before = missing_before(chain, from);
  chain.damage_after = headers.value().damage;
  return chain;
}

Result<std::uint64_t> database_id_of(Disk& disk, const std::vector<std::uint64_t>& segments) {
  for (const std::uint64_t number : segments) {
    auto found = read_header(disk, number);
    if (!found) return found.error();
    if (found.value().header) return found.value().header->database_id;
  }
  return std::uint64_t{0};
}

}  // namespace rtstdb::log
