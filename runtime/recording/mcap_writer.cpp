#include "runtime/recording/mcap_writer.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>

#include <hil/require.hpp>

#include "io/device.hpp"
#include "runtime/recording/mcap_records.hpp"

namespace hil::recording {
namespace {

using mcap::append;
using mcap::append_record;
using mcap::append_text;
using mcap::Op;

constexpr std::size_t chunk_target_bytes = std::size_t{1} << 20;  // of records, before compression
constexpr int compression_level = 1;

// The lengths of records of MCAP, for the space that is set aside.
constexpr std::uint64_t chunk_fields = mcap::record_head + 8 + 8 + 8 + 4 + 4 + 4 + 8;
constexpr std::uint64_t message_index_fields = mcap::record_head + 2 + 4;
constexpr std::uint64_t message_index_entry = 8 + 8;
constexpr std::uint64_t chunk_index_fields = mcap::record_head + 4 * 8 + 4 + 8 + 4 + 4 + 8 + 8;
constexpr std::uint64_t chunk_index_entry = 2 + 8;
constexpr std::uint64_t message_fields = mcap::record_head + 2 + 4 + 8 + 8;
constexpr std::uint64_t statistics_fields = mcap::record_head + 8 + 2 + 4 * 4 + 8 + 8 + 4;
constexpr std::uint64_t statistics_entry = 2 + 8;
constexpr std::uint64_t summary_offset_record = mcap::record_head + 1 + 8 + 8;
constexpr std::uint64_t end_of_file =
    mcap::record_head + 4 + 5 * summary_offset_record + mcap::record_head + 8 + 8 + 4 + mcap::magic.size();

std::uint32_t crc_of(std::string_view bytes, std::uint32_t crc = 0) {
  return static_cast<std::uint32_t>(
      ::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

struct McapWriter::Compression {
  ZSTD_CCtx* context = ZSTD_createCCtx();
  std::string compressed;

  Compression() {
    if (context == nullptr) throw std::bad_alloc();
  }
  ~Compression() { ZSTD_freeCCtx(context); }
  Compression(const Compression&) = delete;
  Compression& operator=(const Compression&) = delete;

  /// Valid until the next call.
  std::string_view of(std::string_view bytes) {
    compressed.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size = ZSTD_compressCCtx(context, compressed.data(), compressed.size(), bytes.data(),
                                               bytes.size(), compression_level);
    if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // the destination is long enough
    return std::string_view(compressed).substr(0, size);
  }
};

McapWriter::McapWriter(const std::filesystem::path& file, std::uint64_t max_bytes)
    : path_(file),
      max_bytes_(max_bytes),
      file_(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666)),
      compression_(std::make_unique<Compression>()) {
  if (file_ < 0) throw io::DeviceError(file.string() + " can not be written: " + std::strerror(errno));
  std::string bytes(mcap::magic);
  append_record(bytes, Op::header, [](std::string& content) {
    append_text(content, "");  // profile
    append_text(content, "hil");
  });
  put(bytes);
}

McapWriter::~McapWriter() {
  close();
}

bool McapWriter::add_topic(const McapTopic& topic, std::uint16_t& channel) {
  if (channels_.size() == max_topics) return false;
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  std::string schema, record;
  append_record(schema, Op::schema, [&](std::string& content) {
    append(content, id);
    append_text(content, topic.schema_name);
    append_text(content, "jsonschema");
    append_text(content, topic.schema);
  });
  append_record(record, Op::channel, [&](std::string& content) {
    append(content, id);
    append(content, id);  // of its schema
    append_text(content, topic.name);
    append_text(content, "json");
    append(content, std::uint32_t{0});  // metadata
  });
  if (!has_space_for(2 * (schema.size() + record.size()) + statistics_entry, max_bytes_)) return false;
  put(schema + record);
  schemas_ += schema;
  channel_records_ += record;
  channels_.emplace_back();
  channel = static_cast<std::uint16_t>(id - 1);
  return true;
}

bool McapWriter::add_metadata(std::string_view name, const McapMetadata& values) {
  finish_chunk();
  std::string record, index;
  append_record(record, Op::metadata, [&](std::string& content) {
    append_text(content, name);
    std::string map;
    for (const auto& [key, value] : values) {
      append_text(map, key);
      append_text(map, value);
    }
    append_text(content, map);
  });
  append_record(index, Op::metadata_index, [&](std::string& content) {
    append(content, bytes_);
    append(content, std::uint64_t{record.size()});
    append_text(content, name);
  });
  if (!has_space_for(record.size() + index.size(), max_bytes_)) return false;
  put(record);
  metadata_indexes_ += index;
  ++metadata_;
  return true;
}

bool McapWriter::has_space_for(std::uint64_t more, std::uint64_t limit) const noexcept {
  std::uint64_t open_chunk = 0;
  if (!chunk_.empty()) {
    open_chunk = chunk_fields + ZSTD_compressBound(chunk_.size()) +
                 chunk_channels_ * (message_index_fields + chunk_index_entry) +
                 chunk_messages_ * message_index_entry + chunk_index_fields;
  }
  const std::uint64_t summary_bytes = schemas_.size() + channel_records_.size() + chunk_indexes_.size() +
                                      metadata_indexes_.size() + statistics_fields +
                                      channels_.size() * statistics_entry;
  return bytes_ + open_chunk + more + summary_bytes + end_of_file <= limit;
}

bool McapWriter::write(std::uint16_t channel, std::int64_t time_ns, std::string_view data,
                       std::uint64_t limit) {
  config::require(time_ns >= 0, "a message has a run time from 0 on");
  Channel& of = channels_[channel];
  const std::uint64_t size = message_fields + data.size();
  // What a message adds to a chunk of its own, at most. zstd adds to `size` what it adds to the whole.
  const std::uint64_t more = chunk_fields + ZSTD_compressBound(size) + message_index_fields +
                             message_index_entry + chunk_index_fields + chunk_index_entry;
  if (!has_space_for(more, limit)) {
    finish_chunk();  // compressed, it is shorter
    if (!has_space_for(more, limit)) return false;
  }
  const auto time = static_cast<std::uint64_t>(time_ns);
  chunk_begin_ns_ = chunk_.empty() ? time : std::min(chunk_begin_ns_, time);
  chunk_end_ns_ = chunk_.empty() ? time : std::max(chunk_end_ns_, time);
  first_ns_ = messages_ == 0 ? time : std::min(first_ns_, time);
  last_ns_ = messages_ == 0 ? time : std::max(last_ns_, time);
  if (of.in_chunk.empty()) ++chunk_channels_;
  of.in_chunk.push_back({time, chunk_.size()});
  append_record(chunk_, Op::message, [&](std::string& content) {
    append(content, static_cast<std::uint16_t>(channel + 1));
    append(content, static_cast<std::uint32_t>(of.messages));  // sequence
    append(content, time);                                     // log_time
    append(content, time);                                     // publish_time
    content += data;
  });
  ++of.messages;
  ++messages_;
  ++chunk_messages_;
  if (chunk_.size() >= chunk_target_bytes) finish_chunk();
  return true;
}

void McapWriter::finish_chunk() {
  if (chunk_.empty()) return;
  const std::string_view compressed = compression_->of(chunk_);
  const std::uint64_t chunk_offset = bytes_;
  std::string record;
  append_record(record, Op::chunk, [&](std::string& content) {
    append(content, chunk_begin_ns_);
    append(content, chunk_end_ns_);
    append(content, std::uint64_t{chunk_.size()});
    append(content, crc_of(chunk_));
    append_text(content, "zstd");
    append(content, std::uint64_t{compressed.size()});
    content += compressed;
  });
  std::string indexes, offsets;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    std::vector<IndexEntry>& entries = channels_[i].in_chunk;
    if (entries.empty()) continue;
    const auto id = static_cast<std::uint16_t>(i + 1);
    append(offsets, id);
    append(offsets, std::uint64_t{chunk_offset + record.size() + indexes.size()});
    append_record(indexes, Op::message_index, [&](std::string& content) {
      append(content, id);
      append(content, static_cast<std::uint32_t>(entries.size() * message_index_entry));
      for (const IndexEntry& entry : entries) {
        append(content, entry.time_ns);
        append(content, entry.offset);
      }
    });
    entries.clear();
  }
  append_record(chunk_indexes_, Op::chunk_index, [&](std::string& content) {
    append(content, chunk_begin_ns_);
    append(content, chunk_end_ns_);
    append(content, chunk_offset);
    append(content, std::uint64_t{record.size()});
    append_text(content, offsets);
    append(content, std::uint64_t{indexes.size()});
    append_text(content, "zstd");
    append(content, std::uint64_t{compressed.size()});
    append(content, std::uint64_t{chunk_.size()});
  });
  put(record);
  put(indexes);
  ++chunks_;
  chunk_.clear();
  chunk_messages_ = 0;
  chunk_channels_ = 0;
}

/// The summary section, the summary offset section and the footer, without the CRC at its end.
std::string McapWriter::summary(std::uint64_t summary_begin) const {
  std::string statistics;
  append_record(statistics, Op::statistics, [&](std::string& content) {
    append(content, messages_);
    append(content, static_cast<std::uint16_t>(channels_.size()));  // schemas
    append(content, static_cast<std::uint32_t>(channels_.size()));
    append(content, std::uint32_t{0});  // attachments
    append(content, metadata_);
    append(content, chunks_);
    append(content, first_ns_);
    append(content, last_ns_);
    std::string counts;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      append(counts, static_cast<std::uint16_t>(i + 1));
      append(counts, channels_[i].messages);
    }
    append_text(content, counts);
  });
  std::string bytes, offsets;
  const auto add = [&](Op op, const std::string& group) {
    if (group.empty()) return;
    append_record(offsets, Op::summary_offset, [&](std::string& content) {
      append(content, static_cast<std::uint8_t>(op));
      append(content, std::uint64_t{summary_begin + bytes.size()});
      append(content, std::uint64_t{group.size()});
    });
    bytes += group;
  };
  add(Op::schema, schemas_);
  add(Op::channel, channel_records_);
  add(Op::statistics, statistics);
  add(Op::chunk_index, chunk_indexes_);
  add(Op::metadata_index, metadata_indexes_);
  const std::uint64_t offsets_begin = summary_begin + bytes.size();
  bytes += offsets;
  bytes += static_cast<char>(Op::footer);
  append(bytes, std::uint64_t{8 + 8 + 4});
  append(bytes, summary_begin);
  append(bytes, offsets_begin);
  return bytes;
}

std::string McapWriter::close() {
  if (file_ < 0) return {};
  finish_chunk();
  std::string end;
  append_record(end, Op::data_end, [&](std::string& content) { append(content, crc_); });
  put(end);
  std::string bytes = summary(bytes_);
  append(bytes, crc_of(bytes));
  bytes += mcap::magic;
  put(bytes);
  struct stat state {};
  const bool was_cut = ::fstat(file_, &state) == 0 && S_ISREG(state.st_mode) &&
                       static_cast<std::uint64_t>(state.st_size) != bytes_;
  if (::close(file_) != 0 && fault_.empty()) fault_ = std::strerror(errno);
  file_ = -1;
  if (!fault_.empty()) return path_.string() + " could not be written completely: " + fault_;
  return was_cut ? path_.string() + " was changed by another program while the run wrote it" : std::string();
}

/// After the first fault nothing is written: the file ends there.
void McapWriter::put(std::string_view bytes) {
  crc_ = crc_of(bytes, crc_);
  while (fault_.empty() && !bytes.empty()) {
    const ssize_t written = ::write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      fault_ = std::strerror(errno);
      return;
    }
    bytes_ += static_cast<std::uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace hil::recording
