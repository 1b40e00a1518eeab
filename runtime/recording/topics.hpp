#pragma once
// The topics of a recording and the schemas of their messages.
//
// Signals: one topic for each writer. That of a module is `/MODULE` (`/module.MODULE` where that is a topic
// of the recording itself), those of a bus are `/BUS.MESSAGE` for each message or group of inputs and `/BUS`
// for its states, those of variables, stimuli and faults are `/variables`, `/stimuli` and `/faults`. A
// member of a message has the name of its signal, without that of the topic; the signal of a group that has
// its name is `value`.
//
// Threads: pure functions.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/contribution/frame_format.hpp"
#include "runtime/recording/mcap_writer.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::recording {

struct SignalTopic {
  struct Member {
    signals::SignalId signal;
    std::string name;
  };
  McapTopic topic;
  std::vector<Member> members;  ///< at least one
};

/// In the order of their first signals.
std::vector<SignalTopic> signal_topics(const signals::SignalTable& table,
                                       std::span<const signals::SignalId> signals);

McapTopic frame_topic(const std::string& bus, const contribution::FrameFormat& format);
McapTopic event_topic();
McapTopic miss_topic();

}  // namespace hil::recording
