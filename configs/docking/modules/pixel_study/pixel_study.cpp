// The paper's Figure 10: from which distances a sensor with pixels detects a small retro-reflector at a port,
// and in which time, if a pixel is measured by a number of rays or by one beam. The sensor is on the axis of
// the port and looks into it. Bodies stand still.
//
// Each step traces one batch, so the study takes as many steps as it has batches.
//
// Outputs  progress (0 to 1), finished (1: all is traced)
//          tiling_beams_missed: distances at which beams that cover their pixels miss the reflector
//          rays_detected_beyond: distances beyond 2.5 times that of Equation 2 at which rays detect it
//          incomplete: rays and beams whose search was cut short

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include <hil/noise_seed.hpp>
#include <hil/world/beam_query.hpp>
#include <hil/world/receiver.hpp>
#include <hil/world/world_module.hpp>
#include <rtstdb/limits.hpp>

#include "configs/docking/modules/docking.hpp"
#include "configs/docking/modules/pixel_study/study_images.hpp"
#include "configs/docking/modules/pixel_study/study_result.hpp"
#include "configs/docking/modules/pixel_study/study_work.hpp"

namespace hil::modules {
namespace {

constexpr double beyond_equation_2 = 2.5;
/// The reflector may be behind others.
constexpr std::uint32_t returns_per_beam = rtstdb::max_returns_per_cone;

void check_batch(const StudyOptions& options, const config::Place& place, config::Diagnostics& diagnostics) {
  for (const PixelMethod& method : options.methods) {
    if (options.batch <= BeamQuery::max_capacity(method.beam_rad)) continue;
    diagnostics.add(place, "'batch' is " + std::to_string(options.batch) + "; at most " +
                               std::to_string(BeamQuery::max_capacity(method.beam_rad)) +
                               " are possible for a " + name_of(method));
    return;
  }
}

class PixelStudy final : public WorldModule {
 public:
  PixelStudy(const config::Value& parameters, StudyOptions options);

  const WorldPorts& ports() const noexcept override { return ports_; }
  void configure(World& world, const Setup& setup) override;
  void step(WorldStep& context) noexcept override;
  void contribute(contribution::Contribution& report) const override;

 private:
  StudyScene scene_of(World& world, const std::string& caller);
  BeamQuery& query() noexcept;
  void fill(BeamQuery& query, std::uint32_t count, rtstdb::WorldTime t) noexcept;
  void take(BeamQuery& query, std::uint32_t count) noexcept;
  void end_item() noexcept;
  void write_outputs(WorldStep& context) const noexcept;

  const StudyOptions options_;
  const PixelGrid grid_;
  StudyResult result_;
  std::optional<StudyImages> images_;  // from configure on, if the run writes images
  WorldPorts ports_;
  std::string instance_;

  rtstdb::Database* database_ = nullptr;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  std::unique_ptr<BeamQuery> rays_;
  std::vector<std::unique_ptr<BeamQuery>> beams_;  // by method; null for rays
  rtstdb::EntityId reflector_;
  std::uint32_t mask_ = 0;

  std::optional<StudyWork> work_;
  std::uint64_t next_element_ = 0;
  std::vector<double> detection_per_m2_;  // of the reflector, by pixel of StudyPurpose::detection
  std::uint64_t incomplete_ = 0;
};

PixelStudy::PixelStudy(const config::Value& parameters, StudyOptions options)
    : options_(std::move(options)),
      grid_(options_.pixels, options_.field_of_view_rad),
      result_(options_, grid_) {
  for (const config::Value& layer : parameters["layers"].items())
    ports_.layers.push_back({layer.text(), layer.place()});
  ports_.bodies = {{options_.body, parameters["port"]["body"].place()},
                   {options_.reflector, parameters["reflector"].place()}};
  ports_.outputs = {
      {.name = "progress", .unit = "", .about = "Share of the study that is done"},
      {.name = "finished", .unit = "", .about = "1: all is traced"},
      {.name = "tiling_beams_missed",
       .unit = "",
       .about = "Distances at which a beam that covers its pixel does not detect the reflector"},
      {.name = "rays_detected_beyond",
       .unit = "",
       .about = "Distances beyond 2.5 times the one of Equation 2 at which rays detect the reflector"},
      {.name = "incomplete", .unit = "", .about = "Rays and beams whose search was cut short"}};
}

/// Reads the places of the port and the reflector.
StudyScene PixelStudy::scene_of(World& world, const std::string& caller) {
  transaction_->begin({});
  transaction_->read(world.entity_of(options_.body, caller));
  transaction_->read(reflector_);
  const rtstdb::Outcome& outcome = database_->execute(*transaction_);
  if (!outcome.done() || transaction_->state(0) == nullptr || transaction_->state(1) == nullptr)
    throw SetupError(caller + ": the bodies can not be read: " + rtstdb::describe(outcome));
  const rtstdb::EntityRow& reflector = transaction_->state(1)->row;
  if ((reflector.mask & mask_) == 0) {
    throw SetupError(caller + ": '" + options_.reflector +
                     "' is in none of the study's layers, so nothing can detect it");
  }
  for (const rtstdb::EntityRow& row : {transaction_->state(0)->row, reflector}) {
    if (row.motion.v_world_mps != glm::dvec3(0.0) || row.motion.w_world_radps != glm::dvec3(0.0))
      throw SetupError(caller + ": '" + options_.body + "' or '" + options_.reflector +
                       "' moves; a study needs bodies at rest");
  }
  const auto pose_of = [&](std::uint32_t ordinal) {
    return rtstdb::pose_at(transaction_->state(ordinal)->row.motion, rtstdb::world_time_ns(0));
  };
  const rtstdb::Pose body = pose_of(0);
  return {.port_m = body.p_world_m + body.q_world * options_.port.point_m,
          .axis = body.q_world * options_.port.axis,
          .reflector_m = pose_of(1).p_world_m};
}

void PixelStudy::configure(World& world, const Setup& setup) {
  const TaskParameters& task = setup.task;
  instance_ = task.instance;
  const std::string caller = "module " + task.instance;
  database_ = &world.database();
  reflector_ = world.entity_of(options_.reflector, caller);
  mask_ = world.mask_of(options_.layers, caller);
  transaction_ = database_->make_transaction({.max_queries = 1, .max_reads = 2});
  work_.emplace(options_, grid_, scene_of(world, caller),
                static_cast<std::uint64_t>(noise_seed(task.seed, task.instance)));
  detection_per_m2_.resize(work_->max_detection_pixels());
  if (options_.images) images_.emplace(options_);
  const auto prepare = [&](const PixelMethod& method) {
    auto query = BeamQuery::prepare(*database_, {.name = task.instance + " " + name_of(method),
                                                 .capacity = options_.batch,
                                                 .divergence_rad = method.beam_rad,
                                                 .returns_per_beam = method.is_beam() ? returns_per_beam : 1,
                                                 .mode = options_.mode});
    if (!query) throw RefusedByDatabase(caller, query.error());
    return std::move(query).value();
  };
  for (const PixelMethod& method : options_.methods) {
    beams_.push_back(method.is_beam() ? prepare(method) : nullptr);
    if (!method.is_beam() && !rays_) rays_ = prepare(method);
  }
}

BeamQuery& PixelStudy::query() noexcept {
  const std::unique_ptr<BeamQuery>& beams = beams_[work_->method()];
  return beams ? *beams : *rays_;
}

void PixelStudy::fill(BeamQuery& query, std::uint32_t count, rtstdb::WorldTime t) noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    rtstdb::Ray ray;
    ray.origin_m = glm::vec3(work_->sensor_m());
    ray.direction = glm::vec3(work_->element(next_element_ + i).direction_world);
    ray.lambda_max = static_cast<float>(options_.range_m);
    ray.t = t;
    ray.mask = mask_;
    query.set(i, ray);
  }
}

void PixelStudy::take(BeamQuery& query, std::uint32_t count) noexcept {
  const double share = 1.0 / options_.methods[work_->method()].samples();
  for (std::uint32_t i = 0; i < count; ++i) {
    double all = 0.0, of_reflector = 0.0;
    const StudyElement element = work_->element(next_element_ + i);
    for (std::uint32_t ordinal = 0; ordinal < query.returns_per_beam(); ++ordinal) {
      const BeamReturn found = query.at(i, ordinal);
      if (found.hit.status == rtstdb::HitStatus::incomplete) {
        ++incomplete_;
        break;
      }
      if (found.hit.status != rtstdb::HitStatus::hit) break;
      const rtstdb::Material material = database_->material(found.hit.material).value_or(rtstdb::Material{});
      const double cosine = std::abs(glm::dot(glm::dvec3(found.hit.n_world), element.direction_world));
      const double intensity =
          share * intensity_per_m2(material, found.fraction, cosine, static_cast<double>(found.hit.lambda));
      all += intensity;
      if (found.hit.entity == reflector_) of_reflector += intensity;
    }
    if (work_->purpose() == StudyPurpose::detection) {
      detection_per_m2_[element.pixel] += of_reflector;
    } else if (images_ && !work_->is_repeated(next_element_ + i)) {
      images_->add(element.pixel, all, of_reflector);
    }
  }
}

void PixelStudy::end_item() noexcept {
  MethodResult& result = result_.at(work_->distance(), work_->method());
  if (work_->purpose() == StudyPurpose::detection) {
    const std::uint64_t pixels = work_->pixels_of_a_shift();
    for (std::uint32_t shift = 0; shift < options_.shifts; ++shift) {
      const auto first = detection_per_m2_.begin() + static_cast<std::ptrdiff_t>(shift * pixels);
      result.detections +=
          std::any_of(first, first + static_cast<std::ptrdiff_t>(pixels),
                      [&](double intensity) { return intensity > options_.threshold_per_m2; })
              ? 1
              : 0;
    }
    std::ranges::fill(detection_per_m2_, 0.0);
  } else if (work_->purpose() == StudyPurpose::port) {
    result.port_pixels = work_->pixels();
    result.port.pixels = work_->repetitions() * work_->pixels();
  } else {
    result.beside_port.pixels = work_->pixels();
    result.pixels_beside_port = work_->pixels_beside_port();
    result.complete = true;
    if (images_) images_->finish(work_->distance(), work_->method());
  }
  next_element_ = 0;
  work_->next_item();
}

void PixelStudy::step(WorldStep& context) noexcept {
  if (!work_->is_over()) {
    const auto count = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(options_.batch, work_->elements() - next_element_));
    BeamQuery& query = this->query();
    fill(query, count, context.world_time());
    transaction_->begin({.deadline_class = context.read_class,
                         .deadline = context.deadline,
                         .importance = 0,
                         .world_time = {},
                         .read_at = rtstdb::ReadAt::pinned(context.version)});
    query.add_to(*transaction_, count);
    // Not the clock of the run, which stands still in a step under the virtual clock.
    const auto began = std::chrono::steady_clock::now();
    const rtstdb::Outcome& outcome = context.execute(*database_, *transaction_);
    const std::int64_t wall_ns = (std::chrono::steady_clock::now() - began).count();
    if (outcome.done()) {
      MethodResult& result = result_.at(work_->distance(), work_->method());
      if (work_->purpose() == StudyPurpose::port) result.port.wall_ns += wall_ns;
      if (work_->purpose() == StudyPurpose::beside_port) result.beside_port.wall_ns += wall_ns;
      take(query, count);
      next_element_ += count;
      if (next_element_ == work_->elements()) end_item();
    }
  }
  write_outputs(context);
}

void PixelStudy::write_outputs(WorldStep& context) const noexcept {
  const std::array values{static_cast<double>(work_->items_done()) / static_cast<double>(work_->items()),
                          work_->is_over() ? 1.0 : 0.0, static_cast<double>(result_.missed_by_tiling_beams()),
                          static_cast<double>(result_.detected_by_rays_beyond(beyond_equation_2)),
                          static_cast<double>(incomplete_)};
  std::copy(values.begin(), values.end(), context.outputs.begin());
}

void PixelStudy::contribute(contribution::Contribution& report) const {
  report.sections.push_back(result_.section(instance_));
  if (images_) images_->add_to(report, instance_);
  if (work_ && !work_->is_over()) {
    report.events.push_back({report.end_ns, "the study " + instance_ + " is not finished: item " +
                                                std::to_string(work_->items_done() + 1) + " of " +
                                                std::to_string(work_->items()) + "; use a longer run"});
  }
}

}  // namespace

ModuleType pixel_study_type() {
  return {.name = "pixel_study",
          .about = "From which distances rays and beams in pixels detect a retro-reflector.",
          .parameters = study_schema(),
          .create = [](const config::Value& parameters, const TaskParameters& /*task*/,
                       config::Diagnostics& diagnostics) -> std::unique_ptr<AnyModule> {
            auto options = read_study_options(parameters, diagnostics);
            if (!options) return nullptr;
            check_batch(*options, parameters["batch"].place(), diagnostics);
            return std::make_unique<PixelStudy>(parameters, std::move(*options));
          }};
}

}  // namespace hil::modules
