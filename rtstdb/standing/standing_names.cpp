#include <rtstdb/standing.hpp>

namespace rtstdb {

const char* to_string(EventKind kind) noexcept {
  switch (kind) {
    case EventKind::reset:
      return "reset";
    case EventKind::present:
      return "present";
    case EventKind::complete:
      return "complete";
    case EventKind::enter:
      return "enter";
    case EventKind::exit:
      return "exit";
  }
  return "?";
}

const char* to_string(EventCause cause) noexcept {
  switch (cause) {
    case EventCause::motion:
      return "motion";
    case EventCause::write:
      return "write";
    case EventCause::gap:
      return "gap";
    case EventCause::list:
      return "list";
  }
  return "?";
}

const char* to_string(StandingStatus status) noexcept {
  switch (status) {
    case StandingStatus::following:
      return "following";
    case StandingStatus::ended:
      return "ended";
    case StandingStatus::failed:
      return "failed";
  }
  return "?";
}

}  // namespace rtstdb
