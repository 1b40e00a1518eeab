#include "sample_log.hpp"

#include <cstring>

#include "rtstdb/log/segment_chain.hpp"
#include "rtstdb/log/segment_walk.hpp"
#include "rtstdb/log/writer.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
SampleLog make_sample(const SampleOptions& options) {
  SampleLog sample;
  hil::tests::SimulatedDisk disk(options.seed);
  hil::tests::SimulatedClock clock;
  LiveWorld world(options.seed, sample.history, 1 << 16);
  Recovered nothing = recover(disk).value();
  WriterOptions writer_options;
  writer_options.segment_bytes = options.segment_bytes;
  writer_options.checkpoint_every_bytes = 0;
  auto writer = Writer::start(disk, clock, world.ring(), world, writer_options,
                              start_after(nothing, options.database_id));
  RTSTDB_ASSERT(writer.ok(), "the writer did not start");
  for (int commit = 0; commit < options.commits; ++commit) {
    if (commit == 2 || commit == 9)
      world.add_geometry(disk, options.database_id, static_cast<std::uint64_t>(commit));
    if (commit == 4 || commit == 9) world.add_material();
    if (commit == 5 || commit == 9) world.add_light();
    if (options.checkpoints && (commit == options.commits / 3 || commit == options.commits / 2))
      writer.value()->checkpoint_soon();
    if (commit % 7 == 3) world.commit_and_discard();
    world.commit();
    if (commit % 3 != 0) {
      write_all(*writer.value());
    }
  }
  write_all(*writer.value());
  if (options.moves_at_the_end > 0) {
    world.commit();
    write_all(*writer.value());
    writer.value()->checkpoint_soon();
    write_all(*writer.value());
  }
  for (int move = 0; move < options.moves_at_the_end; ++move)
    world.commit_move();
  write_all(*writer.value());
  if (options.closed) RTSTDB_ASSERT(writer.value()->close(0).ok(), "the writer did not close");
  sample.contents = disk.contents();
  sample.latest = world.latest();
  sample.latest_as_text = text_of(recover(disk).value().world);
  return sample;
}

void remove_before(const Recovered& recovered, Contents& contents) {
  for (const std::uint64_t segment : recovered.listing.segments)
    if (segment < recovered.report.read_from.segment) contents.erase(segment_name(segment));
  for (const std::uint64_t checkpoint : recovered.listing.checkpoints)
    if (checkpoint < recovered.report.checkpoint) contents.erase(checkpoint_name(checkpoint));
}

std::vector<GroupPlace> groups_of(const Contents& contents) {
  hil::tests::SimulatedDisk disk(1, contents);
  const Listing listing = list_log(disk).value();
  const SegmentChain chain = find_chain(disk, listing.segments, 0, {}).value();
  std::vector<GroupPlace> groups;
  for (const SegmentChain::Link& link : chain.links) {
    const std::string name = segment_name(link.header.number);
    const SegmentWalk walk(contents.at(name), link.header.database_id);
    SegmentWalk::Expected expected{sector_bytes, link.header.first_group, link.header.link};
    const char* fault = nullptr;
    while (expected.number < link.end_group) {
      const auto found = walk.group_at(expected, fault);
      if (!found) break;
      groups.push_back({name, expected.offset, found->header, group_bytes(found->header)});
      expected = {expected.offset + group_bytes(found->header), expected.number + 1, found->header.checksum};
    }
  }
  return groups;
}

}  // namespace rtstdb::log::test
