#include "rtstdb/query/contact/contact_query.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "rtstdb/geometry/motion_bounds.hpp"
#include "rtstdb/query/contact/contact_check.hpp"
#include "rtstdb/query/contact/point_choice.hpp"
#include "rtstdb/query/make_query.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

/// Fewer pairs than this one thread packs before another one has woken up.
constexpr std::uint32_t min_pairs_to_share = 256;
constexpr std::uint32_t pairs_per_block = 64;

PairBody body_of(const EntityRow& row, std::uint32_t part, const accel::GeometryPool& pool) noexcept {
  return {row, pool.hull(row.geometry.index, part)};
}

constexpr std::array kernels{gpu::ShaderId::contact_candidates,
                             gpu::ShaderId::contact_distance,
                             gpu::ShaderId::contact_distance_double,
                             gpu::ShaderId::contact_depth,
                             gpu::ShaderId::surface_bounds,
                             gpu::ShaderId::surface_near,
                             gpu::ShaderId::surface_gap,
                             gpu::ShaderId::surface_inside,
                             gpu::ShaderId::surface_descent,
                             gpu::ShaderId::contact_points,
                             gpu::ShaderId::surface_feet};

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const ContactQueryOptions& options) {
  if (auto checked = check_contact_options(options); !checked) return checked.error();
  auto query = std::make_unique<GpuContactQuery>(options);
  GpuContactQuery& gpu_query = *query;
  auto moved = on_device(std::move(query), device);
  if (moved) gpu_query.allocate_host_memory();
  return moved;
}

GpuContactQuery::GpuContactQuery(const ContactQueryOptions& options)
    : GpuQuery(options.capacity, options.late),
      options_(options),
      max_candidates_(candidates_of(options)),
      candidates_(options.capacity, options.max_bodies, max_candidates_),
      surfaces_(surface_pairs_of(options), options.max_surface_triangles) {
  answers_.resize(slots().count());
}

void GpuContactQuery::allocate_host_memory() {
  searches_.resize(options_.capacity);
  candidates_.reserve();
  surfaces_.reserve();
  touching_pairs_.reserve(max_candidates_);
  frames_.resize(max_candidates_);
  const std::uint64_t pairs =
      std::min<std::uint64_t>(std::uint64_t{options_.capacity} * options_.pairs_per_search, max_candidates_);
  touching_ranges_.resize(pairs);
  listed_surfaces_.reserve(std::min<std::uint64_t>(pairs, surface_pairs_of(options_)));
  for (Answers& answers : answers_) {
    answers.pairs.resize(pairs);
    answers.of_searches.resize(options_.capacity);
  }
}

DeviceNeeds GpuContactQuery::device_needs(const gpu::DeviceLimits& /*limits*/) {
  DeviceNeeds needs;
  for (const gpu::ShaderId shader : kernels) {
    const bool searches_tree = shader == gpu::ShaderId::contact_candidates;
    needs.kernels.push_back(searches_tree ? kernel_need(shader, shared::RegionArgs{})
                                          : kernel_need(shader, shared::ContactArgs{}));
  }
  const std::size_t bodies = options_.max_bodies;
  const std::size_t pairs = max_candidates_;
  const auto buffer = [&](gpu::Buffer& target, const char* what, std::size_t bytes, gpu::Memory memory) {
    needs.buffers.push_back({&target, {.name = options_.name + what, .size_bytes = bytes, .memory = memory}});
  };
  buffer(bodies_buffer_, " bodies", bodies * sizeof(shared::RegionRecord), gpu::Memory::upload);
  buffer(counts_, " counts", bodies * sizeof(shared::RegionCount), gpu::Memory::readback);
  buffer(spaces_, " spaces", bodies * sizeof(glm::uvec2), gpu::Memory::upload);
  buffer(ids_, " candidates", (bodies * ids_per_body + pairs) * sizeof(std::uint32_t), gpu::Memory::readback);
  buffer(pairs_, " pairs", pairs * sizeof(shared::PairRecord), gpu::Memory::upload);
  buffer(results_, " results", pairs * sizeof(shared::PairResult), gpu::Memory::readback);
  buffer(listed_pairs_, " listed pairs", pairs * sizeof(std::uint32_t), gpu::Memory::upload);
  buffer(touching_, " touching pairs", pairs * sizeof(std::uint32_t), gpu::Memory::upload);
  buffer(points_, " points", pairs * sizeof(shared::PairPoints), gpu::Memory::readback);
  surfaces_.add_buffers(options_.name, needs);
  return needs;
}

std::vector<const gpu::Buffer*> GpuContactQuery::bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                               const accel::GeometryPool& pool,
                                                               const accel::Tlas& tlas) const {
  using enum gpu::ShaderId;
  if (shader == contact_candidates)
    return {
        &tlas.nodes(slot), &tlas.instances(slot), &tlas.still_bounds(slot), &bodies_buffer_, &counts_, &ids_,
        &spaces_};
  if (shader == contact_distance || shader == contact_distance_double || shader == contact_depth)
    return {&pool.hulls(), &pairs_, &results_, &listed_pairs_};
  if (shader == contact_points) return {&pool.hulls(), &pairs_, &results_, &touching_, &points_};
  return surfaces_.bound_buffers(shader, pool);
}

std::optional<BadInput> GpuContactQuery::check(std::uint32_t count, const RowSource& rows,
                                               TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i)
    if (const auto bad = check_contact_search(searches_[i], i, rows, times)) return bad;
  return std::nullopt;
}

gpu::ShaderId GpuContactQuery::shader_of(std::uint32_t stage) noexcept {
  using Id = gpu::ShaderId;
  if (stage < distance) return Id::contact_candidates;
  if (stage == points) return Id::contact_points;
  if (stage >= surface_feet) return Id::surface_feet;
  if (stage >= surface_samples) return Id::surface_descent;
  constexpr std::array of_stages{Id::contact_distance, Id::contact_distance_double,
                                 Id::contact_depth,    Id::surface_bounds,
                                 Id::surface_near,     Id::surface_gap,
                                 Id::surface_inside};
  return of_stages[stage - distance];
}

const Kernel& GpuContactQuery::kernel_of(std::uint32_t stage) const noexcept {
  return kernel(static_cast<std::size_t>(std::ranges::find(kernels, shader_of(stage)) - kernels.begin()));
}

// ---- the stages on the host

std::uint32_t GpuContactQuery::begin_first_stage(std::uint32_t count, const BatchWorld& world) noexcept {
  touching_pairs_.clear();
  surfaces_.clear();
  listed_surfaces_.clear();
  listed_ = 0;
  count_ = count;
  candidates_.list_bodies(std::span(searches_).first(count), world);
  const auto spaces = spaces_.host_as<glm::uvec2>();
  for (std::uint32_t i = 0; i < candidates_.bodies().size(); ++i)
    spaces[i] = {candidates_.bodies()[i].begin, ids_per_body};
  return static_cast<std::uint32_t>(candidates_.bodies().size());
}

std::uint32_t GpuContactQuery::begin_stage(std::uint32_t stage, const BatchWorld& world) noexcept {
  if (stage == more_candidates) return begin_more_candidates();
  if (stage == distance) return begin_distance(world);
  if (stage == double_distance) return list_pairs(shared::pair_needs_double);
  if (stage == depth) return list_pairs(shared::pair_needs_depth);
  if (stage == surface_bounds) return surfaces_.begin_bounds();
  if (stage == surface_near) return surfaces_.begin_near();
  if (stage == surface_gaps) return surfaces_.begin_gaps();
  if (stage == surface_insides) return surfaces_.begin_insides();
  if (stage < surface_descents) return surfaces_.begin_samples(stage == surface_samples);
  if (stage < points) return surfaces_.begin_descents(stage == surface_descents);
  if (stage == points) return begin_points(world);
  if (stage < surface_feet) return surfaces_.begin_refining(stage == surface_refined);
  return begin_surface_feet();
}

std::uint32_t GpuContactQuery::begin_more_candidates() noexcept {
  candidates_.list_wide_bodies(counts_.host_as<const shared::RegionCount>());
  const auto spaces = spaces_.host_as<glm::uvec2>();
  const auto wide = candidates_.wide_bodies();
  for (std::uint32_t i = 0; i < wide.size(); ++i)
    spaces[i] = {candidates_.bodies()[wide[i]].begin, candidates_.bodies()[wide[i]].found};
  return static_cast<std::uint32_t>(wide.size());
}

std::uint32_t GpuContactQuery::begin_distance(const BatchWorld& world) noexcept {
  candidates_.list_pairs(counts_.host_as<const shared::RegionCount>(), ids_.host_as<std::uint32_t>(), world,
                         surfaces_);
  return static_cast<std::uint32_t>(candidates_.part_pairs().size());
}

/// Lists the pairs of parts in `state`, but not those beyond the margin and farther than another pair of the
/// same bodies.
std::uint32_t GpuContactQuery::list_pairs(std::uint32_t state) noexcept {
  const auto results = results_.host_as<const shared::PairResult>();
  const auto listed = listed_pairs_.host_as<std::uint32_t>();
  std::uint32_t count = 0;
  for (const ContactCandidates::Candidate& candidate : candidates_.candidates()) {
    float nearest_m = std::numeric_limits<float>::max();
    for (std::uint32_t i = candidate.first_pair; i < candidate.end_pair; ++i)
      if (results[i].state != shared::pair_unfinished) nearest_m = std::min(nearest_m, results[i].max_m);
    const float limit_m = std::max(nearest_m, searches_[candidate.search].margin_m);
    for (std::uint32_t i = candidate.first_pair; i < candidate.end_pair; ++i)
      if (results[i].state == state && results[i].min_m <= limit_m) listed[count++] = i;
  }
  return count;
}

std::uint32_t GpuContactQuery::begin_points(const BatchWorld& world) noexcept {
  Answers& answers = answers_[slots().written()];
  std::uint32_t next = 0;  // candidate
  for (std::uint32_t search = 0; search < count_; ++search) {
    const ContactCandidates::SearchState& state = candidates_.state(search);
    ContactAnswer& answer = answers.of_searches[search];
    answer = {};
    const std::uint32_t begin = listed_;
    for (; next < candidates_.candidates().size() && candidates_.candidates()[next].search == search; ++next)
      list_pair(candidates_.candidates()[next], world);
    answer.candidates = state.candidates;
    answer.overflow = answer.overflow || state.overflow;
    answer.incomplete = answer.incomplete || state.incomplete;
    answer.pairs = std::span(answers.pairs).subspan(begin, listed_ - begin);
    if (answer.overflow) note_overflow();
  }
  return static_cast<std::uint32_t>(touching_pairs_.size());
}

bool GpuContactQuery::judge_convex(const ContactCandidates::Candidate& candidate,
                                   ContactPair& pair) const noexcept {
  const auto results = results_.host_as<const shared::PairResult>();
  // The bounds are those of the nearest or deepest parts.
  pair.distance_m = pair.min_distance_m = pair.max_distance_m = std::numeric_limits<float>::max();
  for (std::uint32_t i = candidate.first_pair; i < candidate.end_pair; ++i) {
    const shared::PairResult& result = results[i];
    if (result.state == shared::pair_unfinished) return false;
    pair.min_distance_m = std::min(pair.min_distance_m, result.min_m);
    pair.max_distance_m = std::min(pair.max_distance_m, result.max_m);
    pair.distance_m = std::min(pair.distance_m, result.distance_m);
  }
  // Bounds that are wider than the precision decide where no threshold lies between them.
  const float margin_m = searches_[candidate.search].margin_m;
  const auto contains = [&](float threshold_m) {
    return pair.min_distance_m <= threshold_m && pair.max_distance_m > threshold_m;
  };
  for (std::uint32_t i = candidate.first_pair; i < candidate.end_pair; ++i) {
    const bool is_wide = results[i].state == shared::pair_undecided && results[i].min_m < pair.max_distance_m;
    if (is_wide && (contains(0.0f) || contains(margin_m))) pair.status = PairStatus::undecided;
  }
  return true;
}

bool GpuContactQuery::judge_surfaces(const ContactCandidates::Candidate& candidate,
                                     ContactPair& pair) const noexcept {
  const SurfacePairs::Verdict verdict = candidate.surfaces ? surfaces_.verdict(*candidate.surfaces)
                                                           : SurfacePairs::Verdict{.is_undecided = true};
  if (verdict.is_incomplete) return false;
  pair.distance_m = pair.min_distance_m = pair.max_distance_m = verdict.distance_m;
  pair.n_world = verdict.n_world;
  pair.has_depth = verdict.has_depth;
  if (verdict.is_undecided) {
    pair.status = PairStatus::undecided;
    pair.distance_m = pair.max_distance_m = std::numeric_limits<float>::max();
    pair.min_distance_m = -std::numeric_limits<float>::max();
  }
  return true;
}

void GpuContactQuery::list_pair(const ContactCandidates::Candidate& candidate,
                                const BatchWorld& world) noexcept {
  const ContactSearch& from = searches_[candidate.search];
  Answers& answers = answers_[slots().written()];
  ContactAnswer& answer = answers.of_searches[candidate.search];
  ContactPair pair{.first = candidate.first, .second = candidate.second};
  if (!(candidate.is_convex ? judge_convex(candidate, pair) : judge_surfaces(candidate, pair))) {
    answer.incomplete = true;
    return;
  }
  const bool is_undecided = pair.status == PairStatus::undecided;
  if (is_undecided && !candidate.is_convex) answer.overflow = true;
  if (!is_undecided) {
    pair.status = pair.distance_m <= 0.0f            ? PairStatus::contact
                  : pair.distance_m <= from.margin_m ? PairStatus::near
                                                     : PairStatus::separate;
  }
  const bool is_far =
      is_undecided ? pair.min_distance_m > from.margin_m : pair.status == PairStatus::separate;
  if (is_far && !from.second.valid()) return;
  ++answer.found;
  if (answer.found > options_.pairs_per_search || listed_ == answers.pairs.size()) {
    answer.overflow = true;
    return;
  }
  answers.pairs[listed_] = pair;
  touching_ranges_[listed_] = {};
  if (!is_undecided) {
    if (candidate.is_convex) {
      list_touching(candidate, world);
    } else if (!is_far) {
      listed_surfaces_.push_back(
          {.answered = listed_, .pair = *candidate.surfaces, .search = candidate.search});
      surfaces_.choose_points(*candidate.surfaces);
    }
  }
  ++listed_;
}

/// Lists the normal of a pair, and the parts whose points are reported.
void GpuContactQuery::list_touching(const ContactCandidates::Candidate& candidate,
                                    const BatchWorld& world) noexcept {
  const ContactSearch& from = searches_[candidate.search];
  const auto results = results_.host_as<const shared::PairResult>();
  ContactPair& pair = answers_[slots().written()].pairs[listed_];
  const auto frame_of = [&](const ContactCandidates::PartPair& parts) {
    const auto body = [&](EntityId entity, std::uint32_t part) {
      return body_of(world.rows.row(entity.index)->row, part, world.pool);
    };
    return PairFrame(body(candidate.first, parts.first_part), body(candidate.second, parts.second_part),
                     from.t);
  };
  const auto first_touching = static_cast<std::uint32_t>(touching_pairs_.size());
  for (std::uint32_t i = candidate.first_pair; i < candidate.end_pair; ++i) {
    const shared::PairResult& result = results[i];
    const bool is_nearest = result.distance_m == pair.distance_m;
    const bool has_points = result.distance_m <= from.margin_m;
    if (!is_nearest && !has_points) continue;
    const PairFrame frame = frame_of(candidates_.part_pairs()[i]);
    if (is_nearest) pair.n_world = frame.to_world(result.n);
    if (!has_points) continue;
    touching_.host_as<std::uint32_t>()[touching_pairs_.size()] = i;
    frames_[touching_pairs_.size()] = frame;
    touching_pairs_.push_back({.pair = i, .answered = listed_});
  }
  touching_ranges_[listed_] = {first_touching, static_cast<std::uint32_t>(touching_pairs_.size())};
}

std::uint32_t GpuContactQuery::begin_surface_feet() noexcept {
  const std::uint32_t feet = surfaces_.begin_feet();
  if (feet == 0) write_surface_points(false);
  return feet;
}

void GpuContactQuery::write_surface_points(bool retry_follows) noexcept {
  Answers& answers = answers_[slots().written()];
  for (const ListedSurfaces& listed : listed_surfaces_)
    if (!surfaces_.write_points(listed.pair, retry_follows, answers.pairs[listed.answered]))
      answers.of_searches[listed.search].incomplete = true;
}

// ---- the stages on the device

void GpuContactQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  if (part.stage > more_candidates) {
    if (part.stage == distance && !part.is_retry) pack_pairs(part.range, recording);
    dispatch_pairs(part, recording);
    return;
  }
  for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
    const std::uint32_t place = place_at(part, i);
    pack_body(place,
              candidates_.bodies()[part.stage == candidates ? place : candidates_.wide_bodies()[place]],
              recording);
  }
  dispatch_search(part, recording);
}

void GpuContactQuery::pack_body(std::uint32_t record, const ContactCandidates::Body& body,
                                const Recording& recording) const noexcept {
  const ContactSearch& search = searches_[body.search];
  const accel::Moment moment = recording.view.moment(search.t);
  const EntityRow& row = recording.rows.row(body.entity)->row;
  const Bounds bounds = recording.pool.bounds(row.geometry.index);
  const glm::vec3 scale(row.scale);
  // Single precision places both bodies only up to some units in the last place of where they are.
  const glm::dvec3 p_m = glm::abs(pose_at(row.motion, search.t).p_world_m);
  const double magnitude_m =
      std::max({p_m.x, p_m.y, p_m.z}) + reach_m(bounds, row.scale) + static_cast<double>(search.margin_m);
  const float wider_m =
      search.margin_m + static_cast<float>(16.0 * magnitude_m) * std::numeric_limits<float>::epsilon();
  bodies_buffer_.host_as<shared::RegionRecord>()[record] = {
      .center_m = 0.5f * (bounds.minimum_m + bounds.maximum_m) * scale,
      .flags = body.above ? shared::region_above_excluded : 0u,
      .half_extent_m = 0.5f * (bounds.maximum_m - bounds.minimum_m) * scale + wider_m,
      .mask = body.mask,
      .q = glm::vec4(0.0f, 0.0f, 0.0f, 1.0f),
      .t_ns = moment.t_ns,
      .carrier = recording.tlas.place_of(recording.view.slot, body.entity),
      .excluded = body.entity,
      .instance_base = moment.instance_base,
      .share = moment.share,
      .near_m = 0.0f};
}

void GpuContactQuery::pack_pairs(PlaceRange range, const Recording& recording) noexcept {
  const auto records = pairs_.host_as<shared::PairRecord>();
  const auto pack = [&](std::uint32_t first, std::uint32_t end) {
    for (std::uint32_t pair = first; pair < end; ++pair) {
      const ContactCandidates::PartPair& parts = candidates_.part_pairs()[pair];
      const ContactCandidates::Candidate& candidate = candidates_.candidates()[parts.candidate];
      const ContactSearch& search = searches_[candidate.search];
      const EntityRow& first_row = recording.rows.row(candidate.first.index)->row;
      const EntityRow& second_row = recording.rows.row(candidate.second.index)->row;
      records[pair] = pair_record(body_of(first_row, parts.first_part, recording.pool),
                                  body_of(second_row, parts.second_part, recording.pool), search.t,
                                  search.margin_m, search.second.valid());
    }
  };
  const std::uint32_t count = range.end - range.first;
  if (count < min_pairs_to_share) return pack(range.first, range.end);
  const std::uint32_t blocks = (count + pairs_per_block - 1) / pairs_per_block;
  fork_join().for_each_block(blocks, [&](std::uint32_t block, std::uint32_t /*thread_index*/) {
    const std::uint32_t first = range.first + block * pairs_per_block;
    pack(first, std::min(first + pairs_per_block, range.end));
  });
}

void GpuContactQuery::dispatch_search(const BatchPart& part, const Recording& recording) const noexcept {
  shared::RegionArgs args{};
  args.root = recording.view.root;
  dispatch_places(part, retry_places(), args, recording.halt, limits().processors,
                  [&](const DispatchLayout& layout, const shared::RegionArgs& each) {
                    dispatch(kernel_of(part.stage), recording, layout, each);
                  });
}

void GpuContactQuery::dispatch_pairs(const BatchPart& part, const Recording& recording) const noexcept {
  dispatch_places(part, retry_places(), shared::ContactArgs{}, recording.halt, limits().processors,
                  [&](const DispatchLayout& layout, const shared::ContactArgs& each) {
                    dispatch(kernel_of(part.stage), recording, layout, each);
                  });
}

void GpuContactQuery::unpack(const BatchPart& part, const accel::TlasView& /*view*/) noexcept {
  for (std::uint32_t i = part.range.first; i < part.range.end; ++i) {
    const std::uint32_t place = place_at(part, i);
    const bool incomplete = is_incomplete(place);
    if (incomplete && !part.is_retry) note_incomplete(place);
    if (part.stage == surface_feet && (place + 1 == places() || part.is_retry))
      write_surface_points(!part.is_retry);
    if (part.stage != points) continue;
    Touching& touching = touching_pairs_[place];
    if (incomplete && part.is_retry)
      answers_[slots().written()].of_searches[search_of(touching)].incomplete = true;
    touching.is_done = !incomplete;
    // Once for each pair: with the last of its pairs of parts, or again after a retry.
    const bool is_last = place + 1 == touching_ranges_[touching.answered].end;
    if (is_last || part.is_retry) choose_points(touching.answered);
  }
}

void GpuContactQuery::choose_points(std::uint32_t answered) noexcept {
  const TouchingRange range = touching_ranges_[answered];
  const auto found = points_.host_as<const shared::PairPoints>();
  const auto results = results_.host_as<const shared::PairResult>();
  ContactPair& pair = answers_[slots().written()].pairs[answered];
  const auto point_at = [&](std::uint32_t place, std::uint32_t k) {
    const shared::PairPoints& of_place = found[place];
    return k == 0   ? of_place.point_0
           : k == 1 ? of_place.point_1
           : k == 2 ? of_place.point_2
                    : of_place.point_3;
  };
  const auto take = [&](std::uint32_t place, std::uint32_t k) {
    const PairFrame& frame = frames_[place];
    const glm::vec3 n_world = frame.to_world(results[touching_pairs_[place].pair].n);
    pair.points[pair.point_count++] =
        frame.contact_point(point_at(place, k), n_world, found[place].first_face, found[place].second_face);
  };
  pair.point_count = 0;
  if (range.end - range.first == 1) {
    for (std::uint32_t k = 0; k < std::min(found[range.first].count, shared::max_contact_points); ++k)
      take(range.first, k);
    return;
  }
  const auto records = pairs_.host_as<const shared::PairRecord>();
  PointChoice choice(pair.n_world, 0.1f * records[touching_pairs_[range.first].pair].precision_m);
  for (PointChoice::Step step = choice.begin(); step != PointChoice::Step::done; step = choice.next()) {
    for (std::uint32_t place = range.first; place < range.end; ++place) {
      if (!touching_pairs_[place].is_done) continue;
      const std::uint32_t count = std::min(found[place].count, shared::max_contact_points);
      for (std::uint32_t k = 0; k < count; ++k) {
        const glm::vec4 point = point_at(place, k);
        choice.offer({place, k}, frames_[place].from_first(glm::vec3(point)), point.w);
      }
    }
  }
  for (const PointChoice::Number& number : choice.chosen())
    take(number.place, number.k);
}

// ---- incomplete answers

bool GpuContactQuery::is_incomplete(std::uint32_t place) const noexcept {
  const auto state_of = [&](std::uint32_t pair) {
    return results_.host_as<const shared::PairResult>()[pair].state;
  };
  switch (stage()) {
    case distance:
      return state_of(place) == shared::pair_unfinished;
    case double_distance:
    case depth:
      return state_of(listed_pairs_.host_as<const std::uint32_t>()[place]) == shared::pair_unfinished;
    case points:
      return points_.host_as<const shared::PairPoints>()[place].count == 0;
    case candidates:
    case more_candidates:
      return counts_.host_as<const shared::RegionCount>()[place].incomplete != 0;
    default:
      return surfaces_.is_incomplete(shader_of(stage()), place);
  }
}

std::uint32_t GpuContactQuery::incomplete(std::uint32_t answered) const noexcept {
  const auto answers = std::span(answers_[slots().written()].of_searches).first(answered);
  return static_cast<std::uint32_t>(std::ranges::count_if(answers, &ContactAnswer::incomplete));
}

void GpuContactQuery::mark_incomplete(std::uint32_t search) noexcept {
  answers_[slots().written()].of_searches[search] = {.pairs = {}, .incomplete = true};
}

}  // namespace rtstdb::query
