#include "rtstdb/query/image/image_query.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/image/image_check.hpp"
#include "rtstdb/query/image/specular_albedo.hpp"
#include "rtstdb/query/make_query.hpp"
#include "rtstdb/query/ray/ray_coherence.hpp"

namespace rtstdb::query {
namespace {

/// In the order of device_needs, before the kernels of the searches.
enum ImageKernel : std::uint8_t {
  kernel_rays,
  kernel_center_rays,
  kernel_hit_outputs,
  kernel_listed_hit_outputs,
  kernel_shade,
  kernel_finish,
  kernel_drawn,
  kernel_light,  // this and the next two: real-time mode
  kernel_lobe,
  kernel_gather
};

/// Words that image_shade.comp sets.
enum Activity : std::uint8_t { some_ray, some_shadow_ray };

/// Whether a stage reads the states of paths that were written last, and writes the others.
bool writes_paths(const ImageStages::Stage& stage) noexcept {
  using enum ImageStages::Step;
  if (stage.step == rays) return stage.sample != ImageStages::center;
  return stage.step == light || stage.step == gather || stage.step == shade || stage.step == finish;
}

constexpr float max_neighbour_angle_rad = 0.04f;

std::uint32_t low_word(std::int64_t ns) noexcept {
  return static_cast<std::uint32_t>(ns);
}

shared::MaterialRecord record_of(const Material& material) noexcept {
  return {.base_color = glm::vec3(material.base_color),
          .metallic = static_cast<float>(material.metallic),
          .emission_cdpm2 = glm::vec3(material.emission_cdpm2),
          .roughness = static_cast<float>(material.roughness),
          .transmission = static_cast<float>(material.transmission),
          .refractive_index = static_cast<float>(material.refractive_index),
          .retro_gain = static_cast<float>(material.retro_gain),
          .unused = 0.0f};
}

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const ImageQueryOptions& options) {
  if (auto checked = check_image_options(options); !checked) return checked.error();
  return on_device(std::make_unique<GpuImageQuery>(options), device);
}

GpuImageQuery::GpuImageQuery(const ImageQueryOptions& options)
    : GpuQuery(options.capacity, options.late, shared::image_group_pixels),
      options_(options),
      stages_(options_),
      cameras_(options.capacity),
      closest_(RayMode::closest, 1, stages_.group_pixels()),
      any_(RayMode::any, 1, stages_.group_pixels()),
      answers_(options_, stages_, slots().count()),
      lights_(options_.fixed_lights, zones_per_emitter()) {
  let_retries_pause();
  noted_.reserve(stages_.group_pixels());
}

// ---- the device

gpu::ShaderId GpuImageQuery::gather_shader() const noexcept {
  return has_maps() ? gpu::ShaderId::image_gather_mapped : gpu::ShaderId::image_gather;
}

gpu::ShaderId GpuImageQuery::shade_shader() const noexcept {
  if (!is_real_time()) return gpu::ShaderId::image_shade;
  return has_maps() ? gpu::ShaderId::image_bounce_mapped : gpu::ShaderId::image_bounce;
}

DeviceNeeds GpuImageQuery::device_needs(const gpu::DeviceLimits& limits) {
  using enum gpu::ShaderId;
  DeviceNeeds needs;
  for (const gpu::ShaderId shader :
       {is_real_time() ? image_real_time_rays : image_rays, image_center_rays, image_hit_outputs,
        image_listed_hit_outputs, shade_shader(), image_finish, image_drawn})
    needs.kernels.push_back(kernel_need(shader, shared::ImageArgs{}));
  if (is_real_time())
    for (const gpu::ShaderId shader : {image_light, image_lobe, gather_shader()})
      needs.kernels.push_back(kernel_need(shader, shared::ImageArgs{}));
  closest_.add_needs(needs, options_.name, limits);
  any_.add_needs(needs, options_.name + " shadow", limits);
  const std::size_t pixels = stages_.group_pixels();
  const auto buffer = [&](gpu::Buffer& target, const char* what, std::size_t bytes, gpu::Memory memory,
                          bool texels = false, bool addressed = false) {
    needs.buffers.push_back({&target,
                             {.name = options_.name + what,
                              .size_bytes = bytes,
                              .memory = memory,
                              .texel_uint4 = texels,
                              .texel_float4 = texels,
                              .addressed = addressed}});
  };
  buffer(cameras_buffer_, " cameras", options_.capacity * sizeof(shared::CameraRecord), gpu::Memory::upload);
  buffer(paths_, " paths", 2 * pixels * sizeof(shared::PathRecord), gpu::Memory::device, true);
  buffer(rays_, " rays", pixels * sizeof(Ray), gpu::Memory::device, true);
  buffer(shadow_rays_, " shadow rays", pixels * sizeof(Ray), gpu::Memory::device, true);
  buffer(hits_, " hits", pixels * sizeof(RayHit), gpu::Memory::readback, true, true);
  buffer(shadow_hits_, " shadow hits", pixels * sizeof(RayHit), gpu::Memory::readback, true, true);
  buffer(materials_, " materials", max_materials * sizeof(shared::MaterialRecord), gpu::Memory::upload);
  buffer(lights_buffer_, " lights", max_lights_per_image * sizeof(shared::LightRecord), gpu::Memory::upload);
  buffer(emitters_, " emitting triangles", max_emitter_triangles * sizeof(shared::EmitterTriangle),
         gpu::Memory::upload);
  const std::size_t zones = std::max<std::size_t>(max_lights_per_image * zones_per_emitter(), 1);
  buffer(zones_, " emitting zones", zones * sizeof(shared::EmitterZone), gpu::Memory::upload);
  buffer(zone_points_, " points of emitting zones",
         zones * shared::points_per_zone * sizeof(shared::EmitterPoint), gpu::Memory::upload);
  buffer(albedo_, " albedo", shared::image_albedo_side * shared::image_albedo_side * sizeof(glm::vec4),
         gpu::Memory::upload, true);
  buffer(activity_, " activity", 16, gpu::Memory::readback);
  buffer(listed_, " listed places", pixels * sizeof(std::uint32_t), gpu::Memory::upload);
  buffer(first_hits_, " first hits", stages_.has_lobes() ? pixels * sizeof(RayHit) : 16, gpu::Memory::device,
         true);
  answers_.add_needs(needs, options_.name);
  return needs;
}

std::vector<const gpu::Buffer*> GpuImageQuery::bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                             const accel::GeometryPool& pool,
                                                             const accel::Tlas& tlas) const {
  using enum gpu::ShaderId;
  std::vector<const gpu::Buffer*> common{&cameras_buffer_, &paths_, &tlas.instances(slot),
                                         &tlas.places(slot)};
  const auto with = [&](std::initializer_list<const gpu::Buffer*> more) {
    common.insert(common.end(), more);
    return common;
  };
  const auto with_surfaces = [&](const gpu::Buffer& found, std::initializer_list<const gpu::Buffer*> more) {
    with({&found, &shadow_hits_, &rays_, &shadow_rays_, &materials_, &lights_buffer_, &emitters_, &albedo_,
          &activity_, &pool.geometries(), &pool.attributes(), &paths_});
    return with(more);
  };
  // Stand-ins where nothing reads them.
  const gpu::Buffer& maps = maps_.exists() ? maps_.maps() : activity_;
  const gpu::Buffer& reach = maps_.exists() ? maps_.reach() : activity_;
  switch (shader) {
    case image_rays:
    case image_real_time_rays:
    case image_center_rays:
      return with({&rays_});
    case image_hit_outputs:
      return with({&hits_});
    case image_listed_hit_outputs:
      return with({&hits_, &listed_});
    case image_shade:
    case image_bounce:
      return with_surfaces(hits_, {});
    case image_light:
      return with_surfaces(hits_, {&zones_, &zone_points_});
    case image_bounce_mapped:
      return with_surfaces(hits_, {&maps, &reach});
    case image_lobe:
      return with_surfaces(first_hits_, {});
    case image_gather:
      return with_surfaces(first_hits_, {&hits_});
    case image_gather_mapped:
      return with_surfaces(first_hits_, {&hits_, &maps, &reach});
    case image_finish:
      return with({&shadow_hits_, &paths_});
    case image_drawn:
      return with({&rays_, raster_.exists() ? &raster_.drawn() : &activity_, &pool.triangles(), &pool.nodes(),
                   &tlas.identity_texels(slot), &hits_, &closest_.flags()});
    case ray_any:
    case ray_any_moving:
    case ray_any_packet:
    case ray_any_packet_moving:
    case ray_any_work_sharing:
    case ray_any_work_sharing_moving:
      return any_.bound_buffers(shadow_rays_, slot, pool, tlas);
    default:
      return closest_.bound_buffers(rays_, slot, pool, tlas);
  }
}

void GpuImageQuery::initialize_buffers() noexcept {
  write_specular_albedo(albedo_.host_as<glm::vec4>());
  packed_materials_ = 0;
  lights_.forget();
}

Result<void> GpuImageQuery::create_more(gpu::Device& device) {
  const bool is_drawn = options_.first_hits == FirstHits::rasterised &&
                        (stages_.has_center() || has_maps()) && limits().max_raster_side > 0;
  if (!is_drawn) return {};
  auto result = raster_.create(device, options_.name, options_.width, options_.height, options_.capacity);
  return result && has_maps() ? maps_.create(device, options_) : result;
}

Result<void> GpuImageQuery::bind_more(gpu::Device& device, const accel::GeometryPool& pool,
                                      const accel::Tlas& tlas) {
  if (!raster_.exists()) return {};
  auto raster_bound = raster_.bind(device, cameras_buffer_, pool, tlas);
  if (!raster_bound || !maps_.exists()) return raster_bound;
  return maps_.bind(device, cameras_buffer_, lights_buffer_, raster_, pool, tlas);
}

void GpuImageQuery::record_more_warm_up(gpu::Recorder& recorder) noexcept {
  if (raster_.exists()) raster_.record_warm_up(recorder);
  if (maps_.exists()) maps_.record_warm_up(raster_, recorder);
}

// ---- check

std::optional<BadInput> GpuImageQuery::check(std::uint32_t tiles, const RowSource& rows,
                                             TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < tiles / stages_.tiles_per_image(); ++i)
    if (const auto bad = check_camera(cameras_[i], options_, i, rows, times)) return bad;
  return std::nullopt;
}

// ---- stages

std::uint32_t GpuImageQuery::begin_first_stage(std::uint32_t tiles, const BatchWorld& world) noexcept {
  tiles_ = tiles;
  answers_.begin_batch(slots().written());
  noted_.clear();
  if (tiles == 0) {
    stages_.begin_batch(0, 0);
    return 0;
  }
  const std::uint32_t mask = pack_cameras();
  pack_materials(world.appearance);
  lights_.collect(world, mask,
                  {.lights = lights_buffer_.host_as<shared::LightRecord>(),
                   .triangles = emitters_.host_as<shared::EmitterTriangle>(),
                   .zones = zones_.host_as<shared::EmitterZone>(),
                   .points = zone_points_.host_as<shared::EmitterPoint>()},
                  maps_.exists() ? options_.shadow_maps : 0);
  stages_.begin_batch(tiles, lights_.counts().points(options_.emitter_points));
  if (lights_.overflow()) {
    note_overflow();
    answers_.note_overflow_of_lights();
  }
  return begin(stages_.at(0));
}

std::uint32_t GpuImageQuery::begin_stage(std::uint32_t stage, const BatchWorld& /*world*/) noexcept {
  if (tiles_ == 0) return 0;
  std::ranges::copy(noted_, listed_.host_as<std::uint32_t>().begin());
  listed_count_ = static_cast<std::uint32_t>(noted_.size());
  count_incomplete_pixels();
  return begin(stages_.at(stage));
}

std::uint32_t GpuImageQuery::begin(const ImageStages::Stage& stage) noexcept {
  now_ = stage;
  const std::uint32_t first_sample = stages_.has_center() ? center : 0;
  if (stage.step == Step::rays && stage.sample == first_sample) answers_.begin_group();
  const auto activity = activity_.host_as<std::uint32_t>();
  const bool some_path = stage.bounce == 0 || activity[some_ray] != 0;
  switch (stage.step) {
    case Step::raster:
      return uses_raster() ? tiles_ / stages_.tiles_per_image() * draws_per_image() : 0;
    case Step::rays:
      if (is_drawn_stage()) return 0;
      break;
    case Step::hit_outputs:
      if (!stages_.has_hit_outputs()) return 0;
      if (is_drawn_stage()) return listed_count_;
      break;
    case Step::trace:
      if (!some_path || (stage.bounce == 0 && stage.sample != center && stages_.colors_center())) return 0;
      closest_.begin();
      break;
    case Step::light:
      if (!some_path) return 0;
      activity[some_shadow_ray] = 0;
      break;
    case Step::shadow:
      if (activity[some_shadow_ray] == 0) return 0;
      any_.begin();
      break;
    case Step::shade:
      if (!some_path) return 0;
      std::ranges::fill(activity, 0u);
      break;
    case Step::lobe:
      activity[some_ray] = 0;
      break;
    case Step::search:
      if (activity[some_ray] == 0) return 0;
      closest_.begin();
      break;
    case Step::keep:
    case Step::gather:
    case Step::restore:
    case Step::finish:
      break;
  }
  if (writes_paths(stage)) writes_second_ = !writes_second_;
  return stages_.places_of_group(stage.group);
}

std::uint32_t GpuImageQuery::pack_cameras() noexcept {
  std::uint32_t mask = 0;
  const auto records = cameras_buffer_.host_as<shared::CameraRecord>();
  for (std::uint32_t i = 0; i < tiles_ / stages_.tiles_per_image(); ++i) {
    const Camera& camera = cameras_[i];
    const glm::quat q = glm::normalize(camera.q);
    const HalfTangents half = half_tangents(camera, options_);
    shared::CameraRecord record{};
    record.p_m = camera.p_m;
    record.mask = camera.mask;
    record.q = glm::vec4(q.x, q.y, q.z, q.w);
    record.tan_half_x = static_cast<float>(half.x);
    record.tan_half_y = static_cast<float>(half.y);
    record.near_m = camera.near_m;
    record.carrier = camera.carrier.valid() ? camera.carrier.index : shared::no_entity;
    record.t_ns = low_word(camera.t.time_since_epoch().count());
    record.row_ns = low_word(camera.row_time.count());
    record.exposure_ns = low_word(camera.exposure.count());
    record.seed = camera.seed;
    record.white_cdpm2 = static_cast<float>(white_cdpm2(static_cast<double>(camera.exposure_value)));
    answers_.set_addresses(i, record);
    records[i] = record;
    mask |= camera.mask;
  }
  return mask;
}

void GpuImageQuery::pack_materials(const Appearance& appearance) noexcept {
  const auto records = materials_.host_as<shared::MaterialRecord>();
  for (; packed_materials_ < appearance.materials(); ++packed_materials_)
    records[packed_materials_] = record_of(*appearance.material({packed_materials_}));
}

bool GpuImageQuery::is_coherent() const noexcept {
  if (now_.step != Step::trace || now_.bounce > 0) return false;
  return std::ranges::all_of(cameras_, [&](const Camera& camera) {
    const auto per_pixel =
        2.0f * static_cast<float>(half_tangents(camera, options_).x) / static_cast<float>(options_.width);
    return per_pixel * static_cast<float>(rays_per_packet) <= max_neighbour_angle_rad &&
           !camera.carrier.valid();
  });
}

// ---- a run

std::uint32_t GpuImageQuery::next_retry_batch() noexcept {
  if (!searches()) return GpuQuery::next_retry_batch();
  if (search().has_paused()) return static_cast<std::uint32_t>(retry_places().size());
  search().begin_retries();
  return advance_retries(shared::paused_rays);
}

void GpuImageQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  if (searches() && (part.is_retry || !is_drawn_stage())) {
    const gpu::Buffer& hits = now_.step == Step::shadow ? shadow_hits_ : hits_;
    const RayPass pass{.hits = hits.address(), .coherent = is_coherent()};
    const RaySearch::Dispatch search_dispatch =
        search().dispatch(part, retry_places(), pass, recording, limits());
    return dispatch(kernel(search_dispatch.kernel), recording, search_dispatch.layout, search_dispatch.args);
  }
  if (now_.step == Step::keep || now_.step == Step::restore) return copy_hits(part.range, recording);
  const shared::ImageArgs args = args_of(part, recording);
  if (now_.step == Step::raster) {
    for (std::uint32_t place = part.range.first; place < part.range.end; ++place)
      draw(place, args, recording);
    return;
  }
  const std::size_t chosen = kernel_of_stage();
  dispatch(kernel(chosen), recording, spread_out(part.range.end - part.range.first, limits().processors),
           args);
}

void GpuImageQuery::draw(std::uint32_t place, const shared::ImageArgs& args,
                         const Recording& recording) noexcept {
  const std::uint32_t image = place / draws_per_image();
  const std::uint32_t draw_of_image = place % draws_per_image();
  if (draw_of_image > 0) {
    maps_.record(raster_, lights_, image, draw_of_image - 1, args, recording, limits().max_groups);
    return;
  }
  raster_.record(image, args, recording, limits().max_groups);
  if (maps_.exists()) maps_.record_reach(raster_, image, args, recording, limits().max_groups);
}

void GpuImageQuery::copy_hits(PlaceRange range, const Recording& recording) noexcept {
  const bool keeps = now_.step == Step::keep;
  const std::size_t from = range.first * sizeof(RayHit);
  recording.recorder.copy(keeps ? hits_ : first_hits_, from, keeps ? first_hits_ : hits_, from,
                          (range.end - range.first) * sizeof(RayHit));
  recording.recorder.barrier();
}

std::size_t GpuImageQuery::kernel_of_stage() const noexcept {
  switch (now_.step) {
    case Step::trace:
      return kernel_drawn;  // other traces are those of the ray search
    case Step::rays:
      return now_.sample == center ? kernel_center_rays : kernel_rays;
    case Step::hit_outputs:
      return is_drawn_stage() ? kernel_listed_hit_outputs : kernel_hit_outputs;
    case Step::light:
      return kernel_light;
    case Step::lobe:
      return kernel_lobe;
    case Step::gather:
      return kernel_gather;
    case Step::shade:
      return kernel_shade;
    default:
      return kernel_finish;
  }
}

shared::ImageArgs GpuImageQuery::args_of(const BatchPart& part, const Recording& recording) const noexcept {
  const ImageLights::Counts& lights = lights_.counts();
  const std::uint32_t written = writes_second_ ? stages_.group_pixels() : 0;
  const std::uint32_t other = stages_.group_pixels() - written;
  return {.first = part.range.first,
          .end = part.range.end,
          .per_group = spread_out(part.range.end - part.range.first, limits().processors).per_group,
          .halt = recording.halt.words,
          .halt_from = recording.halt.from,
          .loop_probe = 2 /* two rounds, see loops_still_turn */,
          .epoch_ns = low_word(recording.view.epoch.time_since_epoch().count()),
          .late_base = recording.view.late_base,
          .width = options_.width,
          .height = options_.height,
          .first_tile = now_.group * stages_.tiles_per_group(),
          .read_from = writes_paths(now_) ? other : written,
          .write_from = written,
          .sample_index = now_.sample,
          .samples = options_.samples_per_pixel,
          .last_bounce = options_.bounces,
          .skies = lights.skies,
          .suns_end = lights.suns_end,
          .emitters_from = lights.emitters_from,
          .lights = lights.all,
          .mapped_end = lights.mapped_end,
          .maps = lights.maps,
          .map_side = options_.shadow_map_side,
          .image = 0,
          .light = now_.light_point,
          .face = 0,
          .lobe = now_.lobe,
          .ray = now_.ray,
          .lobe_rays = stages_.has_lobes() ? options_.lobe_rays : 0,
          .zones_per_emitter = zones_per_emitter()};
}

void GpuImageQuery::unpack(const BatchPart& part, const accel::TlasView& /*view*/) noexcept {
  const bool writes_outputs = now_.step == Step::hit_outputs || now_.step == Step::finish ||
                              (now_.step == Step::trace && is_drawn_stage());
  if (writes_outputs && part.range.end == places()) answers_.pull_group(now_.group);
  if (part.is_retry || !searches()) return;
  const bool any_unanswered = search().some_unanswered();
  if (!search().some_incomplete() && !any_unanswered) return;
  for (std::uint32_t place = part.range.first; place < part.range.end; ++place) {
    if (any_unanswered) searched_hits()[place].status = HitStatus::incomplete;
    if (!is_incomplete(place)) continue;
    note_incomplete(place);
    noted_.push_back(place);
  }
}

bool GpuImageQuery::is_incomplete(std::uint32_t place) const noexcept {
  return searches() && searched_hits()[place].status == HitStatus::incomplete;
}

void GpuImageQuery::count_incomplete_pixels() noexcept {
  for (const std::uint32_t place : noted_)
    if (is_incomplete(place)) answers_.note_incomplete(now_.group, place);
  noted_.clear();
}

}  // namespace rtstdb::query
