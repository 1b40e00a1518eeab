#pragma once
// Writes a file in MCAP (https://mcap.dev/spec), version 0: messages in chunks that are compressed with zstd,
// each followed by its message indexes; then the summary section with schemas, channels, statistics and the
// indexes of chunks and metadata. All CRCs are set. The bytes depend on the calls alone.
//
// The file is never longer than `max_bytes`: what would make it longer is refused, and the space for the rest
// of the file is set aside.
//
// Threads: one at a time. It allocates and writes to the file.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hil::recording {

/// A topic: a schema and a channel with one name each.
struct McapTopic {
  std::string name;         ///< "/plant"
  std::string schema_name;  ///< "hil.plant"
  std::string schema;       ///< JSON Schema of its messages, which are JSON
};

using McapMetadata = std::vector<std::pair<std::string, std::string>>;

class McapWriter {
 public:
  static constexpr std::size_t max_topics = 65'535;

  /// Creates the file. Throws io::DeviceError when that fails.
  McapWriter(const std::filesystem::path& file, std::uint64_t max_bytes);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Adds a topic; `channel` becomes the number of its channel. False when there is no space for it, or there
  /// are max_topics already.
  bool add_topic(const McapTopic& topic, std::uint16_t& channel);
  /// False when there is no space for it.
  bool add_metadata(std::string_view name, const McapMetadata& values);
  /// Writes a message. Its time is run time, which is not negative. Times may be in any order. False when the
  /// file would be longer than `limit`, at most max_bytes; the message is then not written.
  bool write(std::uint16_t channel, std::int64_t time_ns, std::string_view data, std::uint64_t limit);
  /// Completes the file. Returns a sentence when it is incomplete, since it could not be written or another
  /// program changed it; else empty. Idempotent.
  std::string close();

  /// In the file, when it is closed.
  std::uint64_t bytes() const noexcept { return bytes_; }
  std::uint64_t messages() const noexcept { return messages_; }

 private:
  struct IndexEntry {
    std::uint64_t time_ns = 0;
    std::uint64_t offset = 0;  ///< in the chunk
  };
  struct Channel {
    std::uint64_t messages = 0;
    std::vector<IndexEntry> in_chunk;
  };
  struct Compression;  ///< zstd

  bool has_space_for(std::uint64_t more, std::uint64_t limit) const noexcept;
  void finish_chunk();
  void put(std::string_view bytes);
  std::string summary(std::uint64_t summary_begin) const;

  const std::filesystem::path path_;
  const std::uint64_t max_bytes_;
  int file_ = -1;  ///< appends, so that a file that another program cut is shorter than bytes_
  std::string fault_;
  std::uint64_t bytes_ = 0;
  std::uint32_t crc_ = 0;  ///< of all bytes so far
  std::unique_ptr<Compression> compression_;

  std::vector<Channel> channels_;
  std::string chunk_;  ///< records of the chunk that is being filled
  std::uint64_t chunk_begin_ns_ = 0, chunk_end_ns_ = 0;
  std::size_t chunk_messages_ = 0, chunk_channels_ = 0;

  // The records of the summary section.
  std::string schemas_, channel_records_, chunk_indexes_, metadata_indexes_;
  std::uint64_t messages_ = 0, first_ns_ = 0, last_ns_ = 0;
  std::uint32_t chunks_ = 0, metadata_ = 0;
};

}  // namespace hil::recording
