// Texts that describe outcomes.

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <string>

#include <rtstdb/durability.hpp>
#include <rtstdb/limits.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

namespace {

__attribute__((format(printf, 1, 2))) std::string sentence(const char* format, ...) {
  char text[400];
  va_list values;
  va_start(values, format);
  // The analyzer does not follow va_start here.
  std::vsnprintf(text, sizeof text, format, values);  // NOLINT(clang-analyzer-valist.Uninitialized)
  va_end(values);
  return text;
}

double milliseconds(Nanoseconds time) {
  return static_cast<double>(time.count()) * 1e-6;
}

unsigned long long number(Version version) {
  return version;
}

std::string name(EntityId id) {
  return id.valid() ? sentence("entity %u (generation %u)", id.index, id.generation) : "no entity";
}

std::string values_of(const BadInput& fault) {
  return sentence("(%g, %g, %g, %g)", fault.values[0], fault.values[1], fault.values[2], fault.values[3]);
}

/// "scale.x is -1; it must be 1e-06 to 100000", "row_time is -1e-09 s; it must be 0 to 1 s"
std::string about_field(const BadInput& fault) {
  const std::string unit = fault.unit.empty() ? std::string() : " " + std::string(fault.unit);
  const std::string is =
      std::string(fault.field) + sentence(" is %.9g", fault.value) + unit + "; it must be ";
  const bool has_lowest = std::isfinite(fault.lowest), has_highest = std::isfinite(fault.highest);
  if (has_lowest && has_highest) return is + sentence("%.9g to %.9g", fault.lowest, fault.highest) + unit;
  if (has_lowest && fault.lowest > 0.0 && fault.lowest < 1e-30) return is + "above 0";
  if (has_lowest) return is + sentence("%.9g", fault.lowest) + unit + " or above";
  return is + "finite";
}

std::string about_position(const BadInput& fault) {
  return sentence("position %.0f is (%.9g, %.9g, %.9g)", fault.values[3], fault.values[0], fault.values[1],
                  fault.values[2]);
}

std::string about_version(const BadInput& fault) {
  const std::string stated = fault.values[0] < 0.0 ? sentence("world time %.9f s", fault.values[2])
                                                   : sentence("version %llu", number(fault.version));
  if (fault.reason == BadInputReason::unknown_version)
    return stated + " belongs to no version that was published";
  return stated + sentence(" is no longer kept: the oldest kept version is %.0f, from %.9f s on",
                           fault.values[1], fault.values[3]);
}

std::string fault_itself(const BadInput& fault) {
  if (!fault.field.empty()) return about_field(fault);
  switch (fault.reason) {
    case BadInputReason::none:
      return "no fault";
    case BadInputReason::not_finite:
      if (fault.in_geometry_update) return about_position(fault) + ", which is not finite";
      return "a value is not finite: " + values_of(fault);
    case BadInputReason::zero_quaternion:
      return "motion.q_world (w, x, y, z) is " + values_of(fault) + "; at least one of them must not be zero";
    case BadInputReason::out_of_limits:
      if (fault.in_geometry_update)
        return about_position(fault) + ", which is beyond the limit of " +
               sentence("%.9g m", max_coordinate_m);
      return "a value is beyond its limit: " + values_of(fault);
    case BadInputReason::unknown_entity:
      return fault.entity.valid() ? name(fault.entity) + " does not exist" : "it names no entity";
    case BadInputReason::unknown_geometry:
      return sentence("geometry %.0f does not exist", fault.values[0]);
    case BadInputReason::unknown_material:
      return sentence("material %.0f does not exist", fault.values[0]);
    case BadInputReason::unknown_light:
      return sentence("light %.0f does not exist", fault.values[0]);
    case BadInputReason::too_many_entities:
      return sentence("there is room for %.0f entities, and all are alive", fault.values[0]);
    case BadInputReason::world_time_goes_back:
      return sentence("world time %.9f s is before the latest version's %.9f s", fault.values[0],
                      fault.values[1]);
    case BadInputReason::time_not_covered:
      if (fault.values[0] > seconds_between(WorldTime{}, world_time_ns(max_world_time_ns)))
        return sentence("world time %.9f s is beyond its limit of %.0f s", fault.values[0],
                        seconds_between(WorldTime{}, world_time_ns(max_world_time_ns)));
      return sentence(
          "world time %.9f s is not covered by the version that is read, which holds from %.9f s on",
          fault.values[0], fault.values[1]);
    case BadInputReason::window_too_long:
      return sentence("the times of its batch run from %.9f s to %.9f s; they may span %g s", fault.values[0],
                      fault.values[1], fault.values[2]);
    case BadInputReason::beyond_history:
      return sentence("the world at %.9f s is not known: this history ends before %.9f s", fault.values[0],
                      fault.values[1]);
    case BadInputReason::snapshot_too_old:
    case BadInputReason::unknown_version:
      return about_version(fault);
    case BadInputReason::bad_ray:
      return sentence("direction is (%g, %g, %g); its largest component must be 1e-15 to 1e15",
                      fault.values[0], fault.values[1], fault.values[2]);
    case BadInputReason::bad_lambda_range:
      return sentence(
          "lambda_min is %g and lambda_max %g; lambda_min must be finite and 0 or above, and lambda_max not "
          "below it",
          fault.values[0], fault.values[1]);
    case BadInputReason::bad_region:
      return "a region is not valid: " + values_of(fault);
    case BadInputReason::unknown_region_kind:
      return sentence("shape is %.0f and test %.0f; they must be 0 to 2 and 0 to 1", fault.values[0],
                      fault.values[1]);
    case BadInputReason::no_geometry:
      return name(fault.entity) + " has no geometry";
    case BadInputReason::bad_nearest:
      return sentence("radius_m is %g; it must be 0 or above", fault.values[0]);
    case BadInputReason::bad_cone:
      return sentence("a cone is not valid: %g", fault.values[0]);
    case BadInputReason::bad_contact:
      if (!fault.field.empty()) return "a contact search is not valid: " + values_of(fault);
      return name(fault.entity) + " is the second of a pair that has no other first one";
    case BadInputReason::bad_impact:
      if (!fault.field.empty()) return "an impact search is not valid: " + values_of(fault);
      return name(fault.entity) + " can not meet itself";
    case BadInputReason::bad_camera:
      return "a camera is not valid: " + values_of(fault);
    case BadInputReason::geometry_does_not_deform:
      return sentence("geometry %.0f was not added as one that deforms", fault.values[0]);
    case BadInputReason::wrong_position_count:
      return sentence("%.0f positions are given, and the geometry has %.0f", fault.values[0],
                      fault.values[1]);
    case BadInputReason::too_many_positions:
      return sentence("%.0f positions are given, and the transaction has room for %.0f more", fault.values[0],
                      fault.values[1]);
  }
  return "an unnamed fault";
}

std::string place_of(const Outcome& outcome) {
  if (outcome.bad_input.element == BadInput::no_element) return ", in its terms";
  switch (outcome.bad_input.reason) {
    case BadInputReason::beyond_history:
    case BadInputReason::snapshot_too_old:
    case BadInputReason::unknown_version:
      return "";
    case BadInputReason::window_too_long:
      return sentence(", in query %d", outcome.bad_query);
    default:
      break;
  }
  if (outcome.bad_input.in_geometry_update)
    return sentence(", in geometry update %u", outcome.bad_input.element);
  if (outcome.bad_query < 0) return sentence(", in write %u", outcome.bad_input.element);
  return sentence(", in element %u of query %d", outcome.bad_input.element, outcome.bad_query);
}

std::string about_conflict(const Outcome& outcome) {
  const Conflict& conflict = outcome.conflict;
  const std::string found = conflict.entity_exists
                                ? sentence(" was last written by version %llu", number(conflict.written_by))
                                : " does not exist";
  return sentence("conflict: precondition %u does not hold in version %llu: ", conflict.precondition,
                  number(outcome.version)) +
         name(conflict.entity) + found;
}

std::string why_cancelled(CancelledBy by) {
  switch (by) {
    case CancelledBy::caller:
      return " by its caller";
    case CancelledBy::full_queue:
      return ": displaced from a full queue";
    case CancelledBy::closing:
      return " by the database closing";
    case CancelledBy::none:
      break;
  }
  return "";
}

std::string why_refused(const Outcome& outcome) {
  switch (outcome.refused_by) {
    case RefusedBy::log_full:
      return "the log's ring has no space for its writes";
    case RefusedBy::log_fault:
      return "the log's disk refuses writes";
    case RefusedBy::read_only:
      return "a history can not be written";
    case RefusedBy::admission:
    case RefusedBy::none:
      break;
  }
  return sentence(
      "predicted to take %.3f ms; the earliest deadline that could be met lies %.3f ms after it was "
      "submitted",
      milliseconds(outcome.predicted_cost), milliseconds(outcome.earliest_feasible - outcome.submitted));
}

const char* about_doubt(const Outcome& outcome) {
  return outcome.in_doubt ? "; recovery may find it committed if the process ends now" : "";
}

std::string about_done(const Outcome& outcome) {
  std::string text =
      sentence("version %llu, which holds from %.9f s, took %.3f ms", number(outcome.version),
               seconds_between(WorldTime{}, outcome.version_time), milliseconds(outcome.actual_cost));
  if (outcome.predicted_cost.count() != 0) {
    text += sentence(", predicted %.3f ms", milliseconds(outcome.predicted_cost));
  }
  if (outcome.partial) {
    text += "; not all elements were answered by the deadline";
  } else if (outcome.truncated) {
    text += "; at least one answer is incomplete or has overflowed";
  }
  return text;
}

std::string nothing_was_done(const Outcome& outcome) {
  std::string text = "; nothing was done";
  if (outcome.partial) text += ", but some elements were answered by then";
  if (outcome.stale) text += "; earlier answers remain";
  return text;
}

}  // namespace

const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::idle:
      return "idle";
    case Status::pending:
      return "pending";
    case Status::committed:
      return "committed";
    case Status::late:
      return "late";
    case Status::missed:
      return "missed";
    case Status::refused:
      return "refused";
    case Status::conflict:
      return "conflict";
    case Status::cancelled:
      return "cancelled";
    case Status::truncated:
      return "truncated";
    case Status::device_lost:
      return "device_lost";
    case Status::bad_input:
      return "bad_input";
  }
  return "unknown";
}

const char* to_string(DeadlineClass deadline_class) noexcept {
  switch (deadline_class) {
    case DeadlineClass::hard:
      return "hard";
    case DeadlineClass::firm:
      return "firm";
    case DeadlineClass::soft:
      return "soft";
    case DeadlineClass::best_effort:
      return "best_effort";
  }
  return "unknown";
}

const char* to_string(BadInputReason reason) noexcept {
  switch (reason) {
    case BadInputReason::none:
      return "none";
    case BadInputReason::not_finite:
      return "not_finite";
    case BadInputReason::zero_quaternion:
      return "zero_quaternion";
    case BadInputReason::out_of_limits:
      return "out_of_limits";
    case BadInputReason::unknown_entity:
      return "unknown_entity";
    case BadInputReason::unknown_geometry:
      return "unknown_geometry";
    case BadInputReason::unknown_material:
      return "unknown_material";
    case BadInputReason::unknown_light:
      return "unknown_light";
    case BadInputReason::too_many_entities:
      return "too_many_entities";
    case BadInputReason::world_time_goes_back:
      return "world_time_goes_back";
    case BadInputReason::time_not_covered:
      return "time_not_covered";
    case BadInputReason::window_too_long:
      return "window_too_long";
    case BadInputReason::snapshot_too_old:
      return "snapshot_too_old";
    case BadInputReason::beyond_history:
      return "beyond_history";
    case BadInputReason::unknown_version:
      return "unknown_version";
    case BadInputReason::bad_ray:
      return "bad_ray";
    case BadInputReason::bad_lambda_range:
      return "bad_lambda_range";
    case BadInputReason::unknown_region_kind:
      return "unknown_region_kind";
    case BadInputReason::no_geometry:
      return "no_geometry";
    case BadInputReason::bad_region:
      return "bad_region";
    case BadInputReason::bad_nearest:
      return "bad_nearest";
    case BadInputReason::bad_cone:
      return "bad_cone";
    case BadInputReason::bad_contact:
      return "bad_contact";
    case BadInputReason::bad_impact:
      return "bad_impact";
    case BadInputReason::bad_camera:
      return "bad_camera";
    case BadInputReason::geometry_does_not_deform:
      return "geometry_does_not_deform";
    case BadInputReason::wrong_position_count:
      return "wrong_position_count";
    case BadInputReason::too_many_positions:
      return "too_many_positions";
  }
  return "unknown";
}

const char* to_string(RefusedBy refused_by) noexcept {
  switch (refused_by) {
    case RefusedBy::none:
      return "none";
    case RefusedBy::admission:
      return "admission";
    case RefusedBy::log_full:
      return "log_full";
    case RefusedBy::log_fault:
      return "log_fault";
    case RefusedBy::read_only:
      return "read_only";
  }
  return "unknown";
}

const char* to_string(DurabilityMode mode) noexcept {
  switch (mode) {
    case DurabilityMode::volatile_only:
      return "volatile";
    case DurabilityMode::async:
      return "async";
    case DurabilityMode::group:
      return "group";
    case DurabilityMode::sync:
      return "sync";
  }
  return "unknown";
}

std::string describe(const BadInput& bad_input) {
  return std::string(to_string(bad_input.reason)) + ": " + fault_itself(bad_input);
}

std::string describe(const Outcome& outcome) {
  switch (outcome.status) {
    case Status::idle:
      return "idle: not submitted";
    case Status::pending:
      return "pending: no outcome yet";
    case Status::committed:
    case Status::truncated:
      return std::string(to_string(outcome.status)) + ": " + about_done(outcome);
    case Status::late:
      return sentence("late by %.3f ms: ", milliseconds(outcome.lateness)) + about_done(outcome);
    case Status::missed:
      return sentence("missed: the firm deadline had passed by %.3f ms", milliseconds(outcome.lateness)) +
             nothing_was_done(outcome) + about_doubt(outcome);
    case Status::refused:
      return "refused: " + why_refused(outcome) + nothing_was_done(outcome) + about_doubt(outcome);
    case Status::conflict:
      return about_conflict(outcome) + nothing_was_done(outcome);
    case Status::cancelled:
      return "cancelled" + why_cancelled(outcome.cancelled_by) + nothing_was_done(outcome);
    case Status::device_lost:
      return "device_lost: the GPU stopped answering; nothing was published";
    case Status::bad_input:
      return "bad_input: " + fault_itself(outcome.bad_input) + place_of(outcome) + nothing_was_done(outcome);
  }
  return "unknown";
}

}  // namespace rtstdb
