#include "rtstdb/log/reader.hpp"

#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/segment_chain.hpp"
#include "rtstdb/log/segment_walk.hpp"
#include "rtstdb/log/whole_file.hpp"

namespace rtstdb::log {
namespace {

std::string versions_in_words(Version first, Version last) {
  if (first == 0) return "no version";
  if (first == last) return "version " + std::to_string(first);
  return "versions " + std::to_string(first) + " to " + std::to_string(last);
}

class Reading {
 public:
  Reading(Disk& disk, const ReadOptions& options, RecordVisitor& visitor)
      : disk_(disk),
        visitor_(visitor),
        decoder_(options.previous_time),
        from_group_(options.from.group),
        group_(options.from.group),
        link_(options.from.link) {}

  ReadReport report;

  enum class Step : std::uint8_t { advance, end };
  /// Errors: read errors of the disk. Damage is described in `report.damage`.
  Result<Step> segment(const SegmentChain::Link& link, const Position& from);

 private:
  Step group(const SegmentWalk::Found& found);
  Step records(const SegmentWalk::Found& found);
  Step classify_end(const SegmentWalk& walk, const SegmentChain::Link& link, const char* fault);
  Step damaged(const std::string& what, const std::string& found_after = "");

  Disk& disk_;
  RecordVisitor& visitor_;
  RecordDecoder decoder_;
  const std::uint64_t from_group_;
  std::uint64_t segment_ = 0, offset_ = 0;
  std::uint64_t group_, link_;  // of the next group
  Version newest_version_ = 0;
};

Result<Reading::Step> Reading::segment(const SegmentChain::Link& link, const Position& from) {
  auto bytes = read_whole_file(disk_, segment_name(link.header.number));
  if (!bytes) return Error{ErrorCode::file, bytes.error().describe()};
  const SegmentWalk walk(bytes.value(), link.header.database_id);
  ++report.segments;
  segment_ = link.header.number;
  offset_ = segment_ == from.segment && link.header.first_group <= from.group ? from.offset : sector_bytes;
  if (segment_ != from.segment && link.header.first_group < group_) {  // only for the first link
    group_ = link.header.first_group;
    link_ = link.header.link;
  }
  if (offset_ == sector_bytes && link.header.first_group == group_ && link.header.link != link_)
    return damaged("its first group does not follow the one before it");

  while (group_ < link.end_group) {
    report.next = {segment_, offset_, group_, link_};
    if (group_ == from.group && link_ != from.link)
      return damaged("the groups before it are not those before the checkpoint");
    const char* fault = nullptr;
    const auto found = walk.group_at({offset_, group_, link_}, fault);
    if (!found) return classify_end(walk, link, fault);
    if (found->header.flags == closing_flag) {
      const bool last = link.end_group == no_limit && group_ >= from_group_ &&
                        !walk.later_group(offset_ + sector_bytes, group_);
      if (!last) return damaged("the log is closed there, and a group follows");
      report.end = LogEnd::closed;
      return Step::end;
    }
    if (group(*found) == Step::end) return Step::end;
  }
  return Step::advance;
}

Reading::Step Reading::group(const SegmentWalk::Found& found) {
  const Step step = records(found);
  if (step == Step::end) return step;
  report.last = Position{segment_, offset_, group_, link_};
  report.last_bytes = group_bytes(found.header);
  ++report.groups;
  report.bytes += report.last_bytes;
  if (found.header.last_version != 0) newest_version_ = found.header.last_version;
  offset_ += report.last_bytes;
  ++group_;
  link_ = found.header.checksum;
  report.next = {segment_, offset_, group_, link_};
  return step;
}

Reading::Step Reading::records(const SegmentWalk::Found& found) {
  auto payload = found.payload;
  std::uint32_t count = 0;
  while (!payload.empty()) {
    const char* fault = decoder_.decode(payload);
    if (fault == nullptr) fault = visitor_.record(decoder_.record(), {segment_, offset_, &found.header});
    if (fault != nullptr) {
      const GroupHeader& header = found.header;
      const bool has_commits = header.first_version != 0;
      return damaged(
          (has_commits ? versions_in_words(header.first_version, header.last_version) : "its record") +
          " can not be applied: " + fault);
    }
    payload = payload.subspan(decoder_.bytes());
    ++count;
    ++report.records;
    if (visitor_.is_done()) {
      report.end = LogEnd::stopped;
      return Step::end;
    }
  }
  if (count != found.header.records || count == 0)
    return damaged("its number of records is not that in its header");
  return Step::advance;
}

Reading::Step Reading::classify_end(const SegmentWalk& walk, const SegmentChain::Link& link,
                                    const char* fault) {
  // The search starts after this group's header, so that a valid header with incomplete records counts as
  // torn, not as damage.
  const auto later = walk.later_group(offset_ + sector_bytes, group_);
  if (later)
    return damaged(fault, "group " + std::to_string(later->header.number) + " with " +
                              versions_in_words(later->header.first_version, later->header.last_version) +
                              " is valid after it, at offset " + std::to_string(later->offset));
  if (group_ < from_group_)
    return damaged(fault, "the checkpoint continues with group " + std::to_string(from_group_));
  if (link.end_group != no_limit)
    return damaged(fault, "a later segment begins with group " + std::to_string(link.end_group));
  const std::uint64_t allocated = std::uint64_t{link.header.allocated_sectors} * sector_bytes;
  if (walk.bytes() < allocated)
    return damaged(fault, "the file has " + counted(walk.bytes(), "byte") + " and was created with " +
                              std::to_string(allocated) + ": its end was cut off");
  report.cut_bytes = walk.bytes_in_use_from(offset_);
  if (report.cut_bytes == 0) {
    report.end = LogEnd::end_of_data;
  } else {
    report.end = LogEnd::torn;
    report.cut_file = segment_name(segment_);
    report.cut_offset = offset_;
    report.cut_why = fault;
  }
  return Step::end;
}

Reading::Step Reading::damaged(const std::string& what, const std::string& found_after) {
  report.end = LogEnd::damaged;
  report.damage = segment_name(segment_) + ", offset " + std::to_string(offset_) + ", group " +
                  std::to_string(group_) + ", after " + versions_in_words(newest_version_, newest_version_) +
                  ": " + what;
  if (!found_after.empty()) report.damage += "; " + found_after;
  return Step::end;
}

}  // namespace

const char* to_string(LogEnd end) noexcept {
  switch (end) {
    case LogEnd::closed:
      return "closed";
    case LogEnd::end_of_data:
      return "end of data";
    case LogEnd::torn:
      return "torn";
    case LogEnd::stopped:
      return "stopped";
    case LogEnd::damaged:
      return "damaged";
  }
  return "unknown";
}

Result<ReadReport> read_log(Disk& disk, const std::vector<std::uint64_t>& segments,
                            const ReadOptions& options, RecordVisitor& visitor) {
  auto chain = find_chain(disk, segments, options.database_id, options.from);
  if (!chain) return chain.error();
  Reading reading(disk, options, visitor);
  ReadReport& report = reading.report;
  report.database_id = chain.value().database_id;
  report.next = options.from;
  report.damage = chain.value().damage_before;
  if (report.damage.empty()) {
    for (const SegmentChain::Link& link : chain.value().links) {
      auto step = reading.segment(link, options.from);
      if (!step) return step.error();
      if (step.value() == Reading::Step::end) break;
    }
    const bool all_read = report.damage.empty() && report.end != LogEnd::stopped;
    if (all_read) report.damage = chain.value().damage_after;
  }
  if (report.damage.empty()) return std::move(report);
  report.end = LogEnd::damaged;
  if (!options.salvage) return Error{ErrorCode::file, report.damage};
  return std::move(report);
}

}  // namespace rtstdb::log
