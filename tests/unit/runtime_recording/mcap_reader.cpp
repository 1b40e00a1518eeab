#include "mcap_reader.hpp"

#include <zstd.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

namespace hil::recording::test {
namespace {

/// CRC-32 of IEEE 802.3, bit by bit.
std::uint32_t crc_of(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    crc ^= static_cast<std::uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

struct Cursor {
  std::string_view bytes;
  std::size_t at = 0;

  std::uint64_t number(std::size_t size) {
    if (size > bytes.size() - at) throw std::runtime_error("the file ends within a record");
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value |= std::uint64_t{static_cast<std::uint8_t>(bytes[at + i])} << (8 * i);
    at += size;
    return value;
  }
  std::string_view take(std::uint64_t size) {
    if (size > bytes.size() - at) throw std::runtime_error("the file ends within a record");
    at += size;
    return bytes.substr(at - size, size);
  }
  std::string_view text() { return take(number(4)); }
  bool is_at_end() const { return at == bytes.size(); }
};

struct Record {
  std::uint64_t op = 0;
  std::size_t begin = 0, end = 0;  ///< in the bytes
  Cursor content;
};

Record next_record(Cursor& cursor) {
  Record record;
  record.begin = cursor.at;
  record.op = cursor.number(1);
  record.content.bytes = cursor.take(cursor.number(8));
  record.end = cursor.at;
  return record;
}

struct Schema {
  std::string name, text;
  bool operator==(const Schema&) const = default;
};
struct Channel {
  std::uint64_t schema = 0;
  std::string topic;
  bool operator==(const Channel&) const = default;
};
using Entries = std::vector<std::pair<std::uint64_t, std::uint64_t>>;  // time and offset
struct Chunk {
  std::size_t begin = 0, end = 0, indexes_end = 0;
  std::uint64_t begin_ns = 0, end_ns = 0, compressed = 0, size = 0;
  std::map<std::uint64_t, Entries> entries;       ///< as its messages are
  std::map<std::uint64_t, std::size_t> index_at;  ///< of its message indexes
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  ReadMcap read() {
    try {
      read_file();
    } catch (const std::exception& error) {
      fault(error.what());
    }
    return std::move(file_);
  }

 private:
  void fault(const std::string& text) { file_.faults.push_back(text); }
  void require(bool holds, const std::string& text) {
    if (!holds) fault(text);
  }

  void read_file() {
    const std::string magic("\x89MCAP0\r\n", 8);
    require(bytes_.starts_with(magic) && bytes_.ends_with(magic) && bytes_.size() > 2 * magic.size(),
            "magic");
    Cursor cursor{std::string_view(bytes_).substr(0, bytes_.size() - magic.size()), magic.size()};
    Record record = next_record(cursor);
    require(record.op == 0x01, "the header is the first record");
    for (record = next_record(cursor); record.op != 0x0F; record = next_record(cursor))
      data_record(record);
    require(record.content.number(4) == crc_of(cursor.bytes.substr(0, record.begin)),
            "CRC of the data section");
    summary(cursor);
  }

  void schema(Cursor content, std::map<std::uint64_t, Schema>& schemas) {
    const std::uint64_t id = content.number(2);
    require(id != 0, "the id of a schema is not 0");
    Schema& one = schemas[id];
    one.name = content.text();
    require(content.text() == "jsonschema", "encoding of a schema");
    one.text = content.text();
    require(content.is_at_end(), "length of a schema");
  }
  void channel(Cursor content, std::map<std::uint64_t, Channel>& channels) {
    Channel& one = channels[content.number(2)];
    one.schema = content.number(2);
    one.topic = content.text();
    require(content.text() == "json", "encoding of messages");
    require(content.text().empty() && content.is_at_end(), "metadata of a channel");
    require(schemas_.contains(one.schema), "schema of a channel");
  }

  void data_record(Record& record) {
    switch (record.op) {
      case 0x03:
        return schema(record.content, schemas_);
      case 0x04:
        channel(record.content, channels_);
        for (const auto& [id, one] : channels_)
          file_.schemas[one.topic] = schemas_[one.schema].text;
        return;
      case 0x06:
        return chunk(record);
      case 0x07:
        return message_index(record);
      case 0x0C: {
        const std::string name(record.content.text());
        Cursor map{record.content.text()};
        while (!map.is_at_end()) {
          const std::string key(map.text());
          file_.metadata[name][key] = map.text();
        }
        metadata_at_[record.begin] = {record.end - record.begin, name};
        return;
      }
      default:
        fault("a record of an op that is not expected in the data section");
    }
  }

  void chunk(Record& record) {
    Chunk& chunk = chunks_.emplace_back();
    chunk.begin = record.begin;
    chunk.end = chunk.indexes_end = record.end;
    chunk.begin_ns = record.content.number(8);
    chunk.end_ns = record.content.number(8);
    chunk.size = record.content.number(8);
    const std::uint64_t crc = record.content.number(4);
    require(record.content.text() == "zstd", "compression");
    chunk.compressed = record.content.number(8);
    const std::string_view compressed = record.content.take(chunk.compressed);
    require(record.content.is_at_end(), "length of a chunk");
    if (chunk.size > (std::uint64_t{1} << 24U)) throw std::runtime_error("a chunk of more than 16 MiB");
    std::string records(chunk.size, '\0');
    require(
        ZSTD_decompress(records.data(), records.size(), compressed.data(), compressed.size()) == chunk.size,
        "decompression");
    require(crc == crc_of(records), "CRC of a chunk");
    file_.chunks.push_back({chunk.begin_ns, chunk.end_ns, chunk.size});
    std::uint64_t least = UINT64_MAX, largest = 0;
    Cursor cursor{records};
    while (!cursor.is_at_end()) {
      Record one = next_record(cursor);
      require(one.op == 0x05, "a chunk has messages alone");
      const std::uint64_t id = one.content.number(2);
      ReadMessage message;
      message.sequence = static_cast<std::uint32_t>(one.content.number(4));
      message.log_time = one.content.number(8);
      message.publish_time = one.content.number(8);
      message.data = one.content.bytes.substr(one.content.at);
      require(channels_.contains(id), "the channel of a message comes before it");
      message.topic = channels_[id].topic;
      require(message.sequence == counts_[id]++, "sequence of a message");
      chunk.entries[id].emplace_back(message.log_time, one.begin);
      least = std::min(least, message.log_time);
      largest = std::max(largest, message.log_time);
      file_.messages.push_back(std::move(message));
    }
    require(chunk.begin_ns == least && chunk.end_ns == largest, "times of a chunk");
  }

  void message_index(Record& record) {
    if (chunks_.empty()) throw std::runtime_error("a message index without a chunk");
    require(chunks_.back().indexes_end == record.begin, "a message index follows its chunk");
    Chunk& of = chunks_.back();
    of.indexes_end = record.end;
    const std::uint64_t id = record.content.number(2);
    of.index_at[id] = record.begin;
    Cursor list{record.content.text()};
    Entries entries;
    while (!list.is_at_end()) {
      const std::uint64_t time = list.number(8);
      entries.emplace_back(time, list.number(8));
    }
    require(entries == of.entries[id], "a message index has the messages of its chunk");
  }

  void summary(Cursor& cursor) {
    const std::size_t begin = cursor.at;
    std::map<std::uint64_t, Schema> schemas;
    std::map<std::uint64_t, Channel> channels;
    std::map<std::uint64_t, std::pair<std::size_t, std::size_t>> groups;  // by op: begin, end
    std::size_t chunk = 0, metadata = 0, statistics = 0, offsets = 0, offsets_begin = 0;
    for (;;) {
      Record record = next_record(cursor);
      if (record.op != 0x0E && record.op != 0x02) {
        auto [group, is_new] = groups.try_emplace(record.op, record.begin, record.end);
        require(is_new || group->second.second == record.begin, "records of one op are together");
        group->second.second = record.end;
      }
      Cursor& content = record.content;
      if (record.op == 0x03) {
        schema(content, schemas);
      } else if (record.op == 0x04) {
        channel(content, channels);
      } else if (record.op == 0x0B) {
        ++statistics;
        check_statistics(content);
      } else if (record.op == 0x08) {
        if (chunk < chunks_.size()) check_chunk_index(content, chunks_[chunk]);
        ++chunk;
      } else if (record.op == 0x0D) {
        ++metadata;
        const std::uint64_t at = content.number(8), size = content.number(8);
        require(metadata_at_.contains(at) &&
                    metadata_at_[at] == std::pair<std::size_t, std::string>(size, content.text()),
                "index of metadata");
      } else if (record.op == 0x0E) {
        if (offsets++ == 0) offsets_begin = record.begin;
        const std::uint64_t op = content.number(1), at = content.number(8), size = content.number(8);
        require(groups.contains(op) && groups[op] == std::pair<std::size_t, std::size_t>(at, at + size),
                "summary offset");
      } else if (record.op == 0x02) {
        require(content.number(8) == begin, "begin of the summary section");
        require(content.number(8) == offsets_begin, "begin of the summary offsets");
        require(content.number(4) == crc_of(cursor.bytes.substr(begin, record.end - 4 - begin)),
                "CRC of the summary section");
        break;
      } else {
        fault("a record of an op that is not expected in the summary section");
      }
    }
    require(cursor.is_at_end(), "the footer is the last record");
    require(schemas == schemas_ && channels == channels_, "the summary repeats schemas and channels");
    require(statistics == 1, "one record of statistics");
    require(chunk == chunks_.size(), "an index for each chunk");
    require(metadata == metadata_at_.size(), "an index for each record of metadata");
    require(offsets == groups.size(), "a summary offset for each group");
  }

  void check_statistics(Cursor content) {
    require(content.number(8) == file_.messages.size(), "number of messages");
    require(content.number(2) == schemas_.size(), "number of schemas");
    require(content.number(4) == channels_.size(), "number of channels");
    require(content.number(4) == 0, "number of attachments");
    require(content.number(4) == metadata_at_.size(), "number of metadata");
    require(content.number(4) == chunks_.size(), "number of chunks");
    file_.first_ns = content.number(8);
    file_.last_ns = content.number(8);
    Cursor counts{content.text()};
    std::size_t listed = 0;
    for (; !counts.is_at_end(); ++listed) {
      const std::uint64_t id = counts.number(2);
      require(counts.number(8) == counts_[id], "number of messages of a channel");
    }
    require(listed == channels_.size(), "a count for each channel");
  }

  void check_chunk_index(Cursor content, const Chunk& chunk) {
    require(content.number(8) == chunk.begin_ns && content.number(8) == chunk.end_ns,
            "times of a chunk index");
    require(content.number(8) == chunk.begin && content.number(8) == chunk.end - chunk.begin,
            "place of a chunk index");
    Cursor map{content.text()};
    std::map<std::uint64_t, std::size_t> index_at;
    while (!map.is_at_end()) {
      const std::uint64_t id = map.number(2);
      index_at[id] = map.number(8);
    }
    require(index_at == chunk.index_at && index_at.size() == chunk.entries.size(),
            "places of message indexes");
    require(content.number(8) == chunk.indexes_end - chunk.end, "length of message indexes");
    require(content.text() == "zstd", "compression of a chunk index");
    require(content.number(8) == chunk.compressed && content.number(8) == chunk.size,
            "sizes of a chunk index");
  }

  const std::string& bytes_;
  ReadMcap file_;
  std::map<std::uint64_t, Schema> schemas_;
  std::map<std::uint64_t, Channel> channels_;
  std::map<std::uint64_t, std::uint64_t> counts_;
  std::map<std::uint64_t, std::pair<std::size_t, std::string>> metadata_at_;
  std::vector<Chunk> chunks_;
};

}  // namespace

std::vector<ReadMessage> ReadMcap::of(const std::string& topic) const {
  std::vector<ReadMessage> all;
  for (const ReadMessage& message : messages)
    if (message.topic == topic) all.push_back(message);
  return all;
}

ReadMcap read_mcap(const std::string& bytes) {
  return Reader(bytes).read();
}

}  // namespace hil::recording::test
