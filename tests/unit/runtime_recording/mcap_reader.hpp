#pragma once
// Reads a file in MCAP for tests, by the specification: every record, every CRC, and every index against what
// it points to.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace hil::recording::test {

struct ReadMessage {
  std::string topic;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;
  std::uint64_t publish_time = 0;
  std::string data;
};

struct ReadChunk {
  std::uint64_t begin_ns = 0, end_ns = 0;
  std::uint64_t records_bytes = 0;  ///< before compression
};

struct ReadMcap {
  std::vector<std::string> faults;    ///< where the file is not as the specification requires it
  std::vector<ReadMessage> messages;  ///< in the order of the file
  std::vector<ReadChunk> chunks;
  std::map<std::string, std::string> schemas;  ///< by topic
  std::map<std::string, std::map<std::string, std::string>> metadata;
  std::uint64_t first_ns = 0, last_ns = 0;  ///< of the statistics

  std::vector<ReadMessage> of(const std::string& topic) const;
};

ReadMcap read_mcap(const std::string& bytes);

}  // namespace hil::recording::test
