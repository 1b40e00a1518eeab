// to_string of the public enumerations that have none in another file; "unknown" for a value that is no
// enumerator.

#include <rtstdb/database.hpp>
#include <rtstdb/field.hpp>

namespace rtstdb {

const char* to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::bad_input:
      return "bad_input";
    case ErrorCode::no_device:
      return "no_device";
    case ErrorCode::capacity:
      return "capacity";
    case ErrorCode::file:
      return "file";
    case ErrorCode::device_lost:
      return "device_lost";
    case ErrorCode::out_of_memory:
      return "out_of_memory";
  }
  return "unknown";
}

const char* to_string(FieldSign sign) noexcept {
  switch (sign) {
    case FieldSign::automatic:
      return "automatic";
    case FieldSign::winding:
      return "winding";
    case FieldSign::ray_ratio:
      return "ray_ratio";
    case FieldSign::none:
      return "none";
  }
  return "unknown";
}

const char* to_string(PairStatus status) noexcept {
  switch (status) {
    case PairStatus::separate:
      return "separate";
    case PairStatus::near:
      return "near";
    case PairStatus::contact:
      return "contact";
    case PairStatus::undecided:
      return "undecided";
  }
  return "unknown";
}

const char* to_string(LatePolicy policy) noexcept {
  switch (policy) {
    case LatePolicy::discard:
      return "discard";
    case LatePolicy::last_good:
      return "last_good";
    case LatePolicy::partial:
      return "partial";
  }
  return "unknown";
}

const char* to_string(RayMode mode) noexcept {
  switch (mode) {
    case RayMode::closest:
      return "closest";
    case RayMode::any:
      return "any";
    case RayMode::first:
      return "first";
  }
  return "unknown";
}

const char* to_string(Faces faces) noexcept {
  switch (faces) {
    case Faces::both:
      return "both";
    case Faces::front:
      return "front";
    case Faces::back:
      return "back";
  }
  return "unknown";
}

const char* to_string(ConeMode mode) noexcept {
  switch (mode) {
    case ConeMode::exact:
      return "exact";
    case ConeMode::fast:
      return "fast";
  }
  return "unknown";
}

const char* to_string(ImageMode mode) noexcept {
  switch (mode) {
    case ImageMode::path_traced:
      return "path_traced";
    case ImageMode::real_time:
      return "real_time";
  }
  return "unknown";
}

const char* to_string(FirstHits first_hits) noexcept {
  switch (first_hits) {
    case FirstHits::traced:
      return "traced";
    case FirstHits::rasterised:
      return "rasterised";
  }
  return "unknown";
}

const char* to_string(Shadows shadows) noexcept {
  switch (shadows) {
    case Shadows::traced:
      return "traced";
    case Shadows::mapped:
      return "mapped";
  }
  return "unknown";
}

const char* to_string(HitStatus status) noexcept {
  switch (status) {
    case HitStatus::miss:
      return "miss";
    case HitStatus::hit:
      return "hit";
    case HitStatus::incomplete:
      return "incomplete";
  }
  return "unknown";
}

const char* to_string(RegionLevel level) noexcept {
  switch (level) {
    case RegionLevel::bounds:
      return "bounds";
    case RegionLevel::surface:
      return "surface";
    case RegionLevel::triangle:
      return "triangle";
  }
  return "unknown";
}

const char* to_string(RegionShape shape) noexcept {
  switch (shape) {
    case RegionShape::box:
      return "box";
    case RegionShape::sphere:
      return "sphere";
    case RegionShape::frustum:
      return "frustum";
  }
  return "unknown";
}

const char* to_string(RegionTest test) noexcept {
  switch (test) {
    case RegionTest::touching:
      return "touching";
    case RegionTest::inside:
      return "inside";
  }
  return "unknown";
}

const char* to_string(NearestTarget target) noexcept {
  switch (target) {
    case NearestTarget::center:
      return "center";
    case NearestTarget::bounds:
      return "bounds";
    case NearestTarget::surface:
      return "surface";
    case NearestTarget::triangle:
      return "triangle";
  }
  return "unknown";
}

const char* to_string(ReadAt::Kind kind) noexcept {
  switch (kind) {
    case ReadAt::Kind::latest:
      return "latest";
    case ReadAt::Kind::version:
      return "version";
    case ReadAt::Kind::time:
      return "time";
  }
  return "unknown";
}

const char* to_string(CancelledBy by) noexcept {
  switch (by) {
    case CancelledBy::none:
      return "none";
    case CancelledBy::caller:
      return "caller";
    case CancelledBy::full_queue:
      return "full_queue";
    case CancelledBy::closing:
      return "closing";
  }
  return "unknown";
}

const char* to_string(Validation validation) noexcept {
  switch (validation) {
    case Validation::build_default:
      return "build_default";
    case Validation::on:
      return "on";
    case Validation::off:
      return "off";
  }
  return "unknown";
}

const char* to_string(StandingTarget target) noexcept {
  switch (target) {
    case StandingTarget::bounds:
      return "bounds";
    case StandingTarget::center:
      return "center";
  }
  return "unknown";
}

const char* to_string(ImpactStatus status) noexcept {
  switch (status) {
    case ImpactStatus::none:
      return "none";
    case ImpactStatus::impact:
      return "impact";
    case ImpactStatus::undecided:
      return "undecided";
  }
  return "unknown";
}

const char* to_string(UndecidedReason reason) noexcept {
  switch (reason) {
    case UndecidedReason::none:
      return "none";
    case UndecidedReason::steps:
      return "steps";
    case UndecidedReason::distance:
      return "distance";
    case UndecidedReason::capacity:
      return "capacity";
  }
  return "unknown";
}

}  // namespace rtstdb
