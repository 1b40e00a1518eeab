// How the answers of a region search come from the device: sorted lists that the caller reads.

#include <algorithm>

#include "rtstdb/query/point_order.hpp"
#include "rtstdb/query/region/region_search.hpp"

namespace rtstdb::query {
namespace {

/// Fewer ids than this one thread sorts before another one has woken up.
constexpr std::size_t min_ids_to_share = 8192;

constexpr std::size_t ids_per_cache_line = 16;

std::uint64_t sort_key(const glm::uvec2& entity_and_triangle) noexcept {
  return std::uint64_t{entity_and_triangle.x} << 32 | entity_and_triangle.y;
}

}  // namespace

void RegionSearch::allocate_host_memory() {
  const std::size_t capacity = options_.capacity;
  const std::size_t ids = capacity * options_.ids_per_region;
  for (Answers& answers : answers_) {
    if (lists_triangles())
      answers.triangles.resize(ids);
    else
      answers.entities.resize(ids);
    answers.of_regions.resize(capacity);
  }
  order_.resize(capacity);
  begins_.resize(capacity + 1);
  sorters_.resize(ids < min_ids_to_share ? 1 : threads::ForkJoin::thread_count);
  if (!lists_triangles()) return;
  for (Sorter& sorter : sorters_) {
    sorter.by_entity.resize(options_.ids_per_region);
    sorter.numbers.resize(options_.ids_per_region);
  }
}

void RegionSearch::unpack(const BatchPart& part, const accel::TlasView& view) noexcept {
  const PlaceRange range = part.range;
  if (part.is_retry) {
    for (std::uint32_t i = range.first; i < range.end; ++i) {
      const std::uint32_t place = place_at(part, i);
      unpack_answer(place, i, view, sorters_[0]);
      if (answers_[slots().written()].of_regions[order_[place]].overflow) note_overflow();
    }
    return;
  }
  const auto unpack_block = [&](std::uint32_t first, std::uint32_t end, std::uint32_t hand) {
    for (std::uint32_t place = first; place < end; ++place) {
      prefetch_ahead(std::span(answers_[slots().written()].of_regions),
                     std::span<const std::uint32_t>(order_).first(range.end), place);
      unpack_answer(place, place, view, sorters_[hand]);
    }
  };
  if (lay_out(range) < min_ids_to_share) return unpack_block(range.first, range.end, 0);
  const std::uint32_t blocks = (range.end - range.first + places_per_group - 1) / places_per_group;
  fork_join().for_each_block(blocks, [&](std::uint32_t block, std::uint32_t hand) {
    const std::uint32_t first = range.first + block * places_per_group;
    unpack_block(first, std::min(first + places_per_group, range.end), hand);
  });
}

std::size_t RegionSearch::lay_out(PlaceRange range) noexcept {
  const auto counts = counts_.host_as<const shared::RegionCount>();
  if (range.first == 0) begins_[0] = 0;
  std::size_t next = begins_[range.first];
  for (std::uint32_t place = range.first; place < range.end; ++place) {
    begins_[place] = next;
    const bool incomplete = counts[place].incomplete != 0;
    if (incomplete) note_incomplete(place);
    if (!incomplete && overflows(counts[place])) note_overflow();
    // A retry may find more.
    next += incomplete ? options_.ids_per_region : listed(counts[place]);
  }
  begins_[range.end] = next;
  return next - begins_[range.first];
}

void RegionSearch::mark_incomplete(std::uint32_t place) noexcept {
  answers_[slots().written()].of_regions[order_[place]] = {
      .entities = {}, .triangles = {}, .found = 0, .overflow = false, .incomplete = true};
}

void RegionSearch::unpack_answer(std::uint32_t place, std::uint32_t record, const accel::TlasView& view,
                                 Sorter& sorter) noexcept {
  const shared::RegionCount count = counts_.host_as<const shared::RegionCount>()[record];
  RegionAnswer& answer = answers_[slots().written()].of_regions[order_[place]];
  answer = {.entities = {},
            .triangles = {},
            .found = count.found,
            .overflow = overflows(count),
            .incomplete = count.incomplete != 0};
  if (listed(count) == 0) return;
  if (lists_triangles())
    answer.triangles = unpack_triangles(begins_[place], record, listed(count), view, sorter);
  else
    answer.entities = unpack_entities(begins_[place], record, listed(count), view, sorter);
}

std::span<const EntityId> RegionSearch::unpack_entities(std::size_t begin, std::uint32_t record,
                                                        std::uint32_t listed, const accel::TlasView& view,
                                                        Sorter& sorter) noexcept {
  const auto all_ids = ids_.host_as<const std::uint32_t>();
  const std::size_t ids_begin = std::size_t{record} * options_.ids_per_region;
  const auto ids = all_ids.subspan(ids_begin, listed);
  const auto entities = std::span(answers_[slots().written()].entities).subspan(begin, listed);
  // Identities are scattered in memory, and another processor wrote the next region's ids: both are
  // prefetched.
  for (const std::uint32_t index : ids)
    __builtin_prefetch(&view.identities[index]);
  const auto next_ids =
      all_ids.subspan(std::min(ids_begin + options_.ids_per_region, all_ids.size() - listed), listed);
  for (std::size_t k = 0; k < listed; k += ids_per_cache_line)
    __builtin_prefetch(&next_ids[k]);
  std::size_t next = 0;
  sorter.id_order.ascending(ids, [&](std::uint32_t index) { entities[next++] = view.identities[index].id; });
  // A search that was cut short may list an id twice.
  return entities.first(next);
}

std::span<const EntityTriangle> RegionSearch::unpack_triangles(std::size_t begin, std::uint32_t record,
                                                               std::uint32_t listed,
                                                               const accel::TlasView& view,
                                                               Sorter& sorter) noexcept {
  const auto found =
      ids_.host_as<const glm::uvec2>().subspan(std::size_t{record} * options_.ids_per_region, listed);
  const auto triangles = std::span(answers_[slots().written()].triangles).subspan(begin, listed);
  const std::uint32_t entity = found[0].x;
  std::uint32_t difference = 0;
  std::uint32_t first = found[0].y;
  std::uint32_t last = first;
  for (const glm::uvec2& one : found) {
    difference |= one.x ^ entity;
    first = std::min(first, one.y);
    last = std::max(last, one.y);
  }
  std::size_t next = 0;
  // Most often they are of one entity, and near one another in its mesh.
  if (difference == 0 && last - first < max_entities) {
    const auto numbers = std::span(sorter.numbers).first(listed);
    std::ranges::transform(found, numbers.begin(), [&](const glm::uvec2& one) { return one.y - first; });
    const EntityId found_id = view.identities[entity].id;
    sorter.id_order.ascending(numbers, [&](std::uint32_t number) {
      triangles[next++] = {found_id, first + number};
    });
  } else {
    const auto sorted = std::span(sorter.by_entity).first(listed);
    std::ranges::transform(found, sorted.begin(), sort_key);
    std::ranges::sort(sorted);
    for (const std::uint64_t one : std::span(sorted.begin(), std::unique(sorted.begin(), sorted.end())))
      triangles[next++] = {view.identities[one >> 32].id, static_cast<std::uint32_t>(one)};
  }
  // A search that was cut short may list a triangle twice.
  return triangles.first(next);
}

}  // namespace rtstdb::query
