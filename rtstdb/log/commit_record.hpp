#pragma once
// Encodes and decodes the write set of a commit. A commit that consists of one update_motion, as most small
// commits do, has a shorter encoding, the move record.
//
// Encoding: the size is known in advance; it neither allocates nor fails. Decoding trusts nothing
// (record.hpp).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/log/format.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::log {

/// The chosen encoding of a staged set.
struct CommitEncoding {
  RecordKind kind = RecordKind::commit;  ///< or move
  std::uint16_t omitted_words = 0;       ///< move: omitted words
  std::size_t bytes = 0;
};
/// The encoding as a commit record, which every set has.
CommitEncoding commit_record_encoding(const store::WriteSet& set) noexcept;
/// The encoding as a move record if the set is a move, otherwise as a commit record. `previous_time`: world
/// time of the previous commit, if only geometries were recorded since.
CommitEncoding encoding_of(const store::WriteSet& set,
                           const std::optional<WorldTime>& previous_time) noexcept;
/// Upper bound of the size of a set that need not be staged, in any encoding.
std::size_t max_commit_bytes(const store::WriteSet& set) noexcept;
/// `room` has exactly form.bytes bytes.
void encode_commit(const store::WriteSet& set, const CommitEncoding& form,
                   std::span<std::byte> space) noexcept;

/// Decodes commits in the order of the log.
class CommitDecoder {
 public:
  explicit CommitDecoder(std::optional<WorldTime> previous_time) : previous_time_(previous_time) {}

  // Each returns a description of the fault, or null. The set's shapes are valid until the next call.
  [[nodiscard]] const char* decode_commit(std::span<const std::byte> body, store::WriteSet& set);
  [[nodiscard]] const char* decode_move(std::uint16_t omitted_words, std::span<const std::byte> body,
                                        store::WriteSet& set);
  /// The next move record must hold its world time.
  void forget_time() noexcept { previous_time_.reset(); }

 private:
  std::optional<WorldTime> previous_time_;
  std::vector<glm::vec3> positions_m_;  // of all shapes of the commit
};

}  // namespace rtstdb::log
