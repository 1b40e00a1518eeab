#include "rtstdb/field_job.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rtstdb/accel/field_sampler.hpp"
#include "rtstdb/field/field_build.hpp"
#include "rtstdb/geometry/closed_mesh.hpp"

namespace rtstdb {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t min_points = 64;
constexpr std::size_t first_points = 512;

/// Calls the function of the options, which is the caller's.
Result<void> report_progress(const FieldOptions& options, const FieldProgress& progress) {
  if (!options.progress) return {};
  std::string thrown = "an exception that is no std::exception";
  try {
    options.progress(progress);
    return {};
  } catch (const std::exception& exception) {
    thrown = exception.what();
  } catch (...) {
  }
  return Error{ErrorCode::bad_input, "the progress function of a field threw: " + thrown +
                                         "; it must return, so there is no field"};
}

/// Executes `step` on the engine thread.
template <class Step>
Result<void> call_on_engine(transaction::Engine& engine, const Step& step) {
  std::optional<Result<void>> done;
  std::exception_ptr failure;
  engine.call([&] {
    try {
      done.emplace(step());
    } catch (const std::exception&) {
      failure = std::current_exception();
    }
  });
  if (failure) std::rethrow_exception(failure);
  return *done;
}

/// The number of points of the next part, if the last part had `points` and took `took`.
std::size_t next_size(std::size_t points, SteadyClock::duration took, Nanoseconds part) noexcept {
  if (part.count() == 0) return accel::FieldSampler::max_points;
  const double ratio =
      static_cast<double>(part.count()) /
      static_cast<double>(std::max<SteadyClock::duration::rep>(Nanoseconds(took).count(), 1));
  // Searches differ in length: sizes grow slowly and shrink at once.
  const double next_points = static_cast<double>(points) * std::min(ratio, 1.5);
  return std::clamp(static_cast<std::size_t>(next_points), min_points,
                    std::size_t{accel::FieldSampler::max_points});
}

}  // namespace

Result<FieldReport> FieldJob::run(GeometryId geometry, const TriangleMesh& mesh,
                                  const FieldOptions& options) const {
  const auto begun_at = SteadyClock::now();
  const float front_sign = accel::front_sign_of(mesh);
  auto begun = field::FieldBuild::begin(bounds_of(mesh), is_closed(mesh), options);
  if (!begun) return begun.error();
  field::FieldBuild build = std::move(begun).value();
  std::vector<shared::FieldPoint> points(accel::FieldSampler::max_points);
  std::vector<shared::FieldSample> samples(points.size());
  std::size_t size = part.count() == 0 ? points.size() : first_points;
  while (const std::size_t count = build.next(std::span(points).first(size))) {
    const FieldSign sign = build.needs_sign() ? build.sign() : FieldSign::none;
    const auto results = std::span(samples).first(count);
    SteadyClock::duration took{0};
    auto sampled = call_on_engine(engine, [&] {
      const auto part_begun_at = SteadyClock::now();
      auto done = executor.sample_field(geometry, sign, front_sign, std::span(points).first(count), results);
      took = SteadyClock::now() - part_begun_at;
      return done;
    });
    if (!sampled) return sampled.error();
    if (auto taken = build.take(results); !taken) return taken.error();
    if (count == size) size = next_size(size, took, part);
    if (auto reported = report_progress(options, build.progress()); !reported) return reported.error();
  }
  auto field = std::make_shared<field::StoredField>(std::move(build).field());
  field->report.seconds = std::chrono::duration<double>(SteadyClock::now() - begun_at).count();
  const FieldReport report = field->report;
  auto attached = call_on_engine(engine, [&] { return executor.attach_field(geometry, field); });
  if (!attached) return attached.error();
  return report;
}

}  // namespace rtstdb
