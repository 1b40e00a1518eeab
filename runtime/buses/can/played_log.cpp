#include "runtime/buses/can/played_log.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <hil/quantity.hpp>

#include "io/can/candump_line.hpp"
#include "runtime/config/run_end.hpp"
#include "runtime/config/text_lists.hpp"

namespace hil::buses::can {
namespace {

/// Shorter passes flood the bus and its log.
constexpr std::int64_t min_pass_period_ns = 1'000'000;

using config::Diagnostics;
using config::in_quotes;

/// How many frames have one problem, and the line of the first.
struct WarnedFrames {
  std::size_t frames = 0;
  std::uint32_t first_line = 0;

  void add(std::uint32_t line) {
    if (frames++ == 0) first_line = line;
  }
};

class LogReader {
 public:
  LogReader(const PlayedLog& section, const BusIdentifiers& ids, Diagnostics& diagnostics)
      : section_(section), ids_(ids), diagnostics_(diagnostics) {}

  std::optional<io::can::PlaybackConfig> read() {
    const std::size_t before = diagnostics_.count();
    read_lines();
    if (diagnostics_.count() == before) check_interfaces();
    if (diagnostics_.count() == before) check_frames();
    if (diagnostics_.count() != before) return std::nullopt;
    warn(of_sent_, "not played", "the run sends the message itself");
    warn(errors_, "not played", "error frames can not be sent");
    warn(unknown_, "sent, but not received by the run",
         "the database has no message with the identifier; add it there");
    io::can::PlaybackConfig config{
        .name = std::filesystem::path(section_.file.text).filename().string(),
        .frames = std::make_shared<const std::vector<io::can::PlayedFrame>>(std::move(frames_)),
        .begin_ns = section_.begin_ns,
        .pass_period_ns = section_.every_ns.value_or(last_ns_),
        .passes = section_.repeat};
    check_passes(config);
    return diagnostics_.count() == before ? std::optional(std::move(config)) : std::nullopt;
  }

 private:
  void refuse(std::uint32_t line, const std::string& message, std::size_t column = 1) {
    diagnostics_.add({section_.file.text, line, static_cast<std::uint32_t>(column)}, message);
  }

  void read_lines() {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(section_.file.text, error);
    if (!error && bytes > max_log_bytes) {
      return diagnostics_.add(section_.file.place, "the log has " + std::to_string(bytes) +
                                                       " bytes, more than the limit of " +
                                                       std::to_string(max_log_bytes) + "; split it");
    }
    std::ifstream file(section_.file.text, std::ios::binary);
    if (!file.is_open()) return diagnostics_.add(section_.file.place, "the log can not be opened");
    std::string text;
    std::uint32_t line = 1;
    for (; !diagnostics_.full() && std::getline(file, text); ++line) {
      if (text.empty() || text == "\r") continue;
      io::can::CandumpMistake mistake;
      const auto logged = io::can::parse_candump_line(text, &mistake);
      if (!logged) {
        refuse(line, mistake.text + "; a line of candump -l is as '(1436509052.249713) vcan0 044#2A36'",
               mistake.column);
        continue;
      }
      if (!first_ns_) first_ns_ = logged->frame.wall_ns;
      interfaces_.insert(logged->interface);
      if (section_.interface && section_.interface->text != logged->interface) continue;
      if (!take(*logged, line)) return;
    }
    if (file.bad())
      diagnostics_.add(section_.file.place,
                       "the log can not be read after its line " + std::to_string(line - 1));
  }

  /// False with a mistake that ends the reading.
  bool take(const io::can::LoggedFrame& logged, std::uint32_t line) {
    const io::can::Frame& frame = logged.frame;
    const std::int64_t offset_ns = frame.wall_ns - *first_ns_;
    if (offset_ns < last_ns_ - max_log_disorder_ns) {
      refuse(line, "this frame is " + config::format_duration(last_ns_ - offset_ns) +
                       " earlier than an earlier line of its interface; at most " +
                       config::format_duration(max_log_disorder_ns) +
                       " are allowed, so sort the log by time");
      return false;
    }
    last_ns_ = std::max(last_ns_, offset_ns);
    if (frame.is_error()) {
      errors_.add(line);
    } else if (ids_.sent.contains(frame.raw.can_id)) {
      of_sent_.add(line);
    } else if (frames_.size() == max_played_frames) {
      refuse(line,
             "the log has more frames than the limit of " + std::to_string(max_played_frames) + "; split it");
      return false;
    } else {
      const bool is_unknown = !ids_.known.contains(frame.raw.can_id & ~CAN_RTR_FLAG);
      if (is_unknown) unknown_.add(line);
      frames_.push_back({last_ns_, frame.raw, frame.is_fd, is_unknown});
    }
    return true;
  }

  void check_interfaces() {
    const std::vector<std::string> names(interfaces_.begin(), interfaces_.end());
    if (section_.interface && !interfaces_.contains(section_.interface->text)) {
      diagnostics_.add(section_.interface->place, "the log has no frame of " +
                                                      in_quotes(section_.interface->text) +
                                                      config::suggestion(section_.interface->text, names));
    } else if (!section_.interface && names.size() > 1) {
      diagnostics_.add(section_.file.place,
                       "the log has frames of " + config::text_list(names) + "; 'interface' has to name one");
    }
  }

  void check_frames() {
    if (frames_.empty()) return diagnostics_.add(section_.file.place, why_no_frame());
    if (unknown_.frames == frames_.size()) {
      return diagnostics_.add(
          section_.file.place,
          "no frame of the log that would be played has an identifier of the database, so the run "
          "would receive none of these " +
              std::to_string(frames_.size()) + "; play a log of this bus, or use the database of the log");
    }
    const std::int64_t first_ns = section_.begin_ns + frames_.front().offset_ns;
    const std::string reason = config::reason_without_tick(
        first_ns, section_.send_interval_ns, section_.run_ns, "the last instant at which the bus sends,");
    if (!reason.empty())
      diagnostics_.add(section_.begin_place,
                       "'begin': no frame of the log would be sent: the first one is due at " +
                           config::format_duration(first_ns) + ", which" + reason);
  }

  std::string why_no_frame() const {
    const auto counted = [](std::size_t count, const char* one, const char* several) {
      return std::to_string(count) + " " + (count == 1 ? one : several);
    };
    if (of_sent_.frames + errors_.frames == 0) return "the log has no frame";
    std::string reasons;
    if (of_sent_.frames > 0)
      reasons = counted(of_sent_.frames, "is of a message", "are of messages") +
                " under 'send', which the run sends itself";
    if (errors_.frames > 0)
      reasons += (reasons.empty() ? "" : ", and ") +
                 counted(errors_.frames, "is an error frame, which", "are error frames, which") +
                 " can not be sent";
    return "no frame of the log is left to play: of its " +
           counted(of_sent_.frames + errors_.frames, "frame, ", "frames, ") + reasons;
  }

  void check_passes(const io::can::PlaybackConfig& config) {
    if (section_.every_ns && *section_.every_ns < last_ns_) {
      diagnostics_.add(section_.every_place, "'every': " + config::format_duration(*section_.every_ns) +
                                                 " is shorter than the log, which takes " +
                                                 config::format_duration(last_ns_));
    } else if (config.passes != 1 && config.pass_period_ns == 0) {
      diagnostics_.add(section_.file.place,
                       "the frames of the log are at one instant; to repeat it, give "
                       "'every', the time from the start of a pass to the next one");
    } else if (config.passes != 1 && config.pass_period_ns < min_pass_period_ns) {
      diagnostics_.add(section_.every_ns ? section_.every_place : section_.file.place,
                       "passes of the log would begin every " +
                           config::format_duration(config.pass_period_ns) + "; 'every' has to be at least " +
                           config::format_duration(min_pass_period_ns));
    }
  }

  /// `what`: "not played", of one frame or of several.
  void warn(const WarnedFrames& warned, const std::string& what, const std::string& why) {
    if (warned.frames == 0) return;
    const std::string frames = warned.frames == 1 ? "this frame is " + what + ": "
                                                  : std::to_string(warned.frames) + " frames are " + what +
                                                        ", the first in this line: ";
    diagnostics_.warn({section_.file.text, warned.first_line, 1}, frames + why);
  }

  const PlayedLog& section_;
  const BusIdentifiers& ids_;
  Diagnostics& diagnostics_;
  std::optional<std::int64_t> first_ns_;  ///< of the log, whatever the interface
  std::int64_t last_ns_ = 0;              ///< the largest offset of the interface so far
  std::set<std::string> interfaces_;
  std::vector<io::can::PlayedFrame> frames_;
  WarnedFrames of_sent_, errors_, unknown_;
};

}  // namespace

std::optional<io::can::PlaybackConfig> read_played_log(const PlayedLog& section, const BusIdentifiers& ids,
                                                       Diagnostics& diagnostics) {
  return LogReader(section, ids, diagnostics).read();
}

}  // namespace hil::buses::can
