#pragma once
// A small GPU abstraction: device, buffer, pipeline, bindings, recorder (a command buffer) and timeline (an
// ordered queue of submissions); the rasteriser is in raster.hpp. A device uses one queue, for compute,
// copies and, where it can, draws. Only the sources of rtstdb/gpu name Vulkan; this header does not.
//
// Threads: Device calls that create something may come from one thread at a time (setup). A Recorder and a
// Timeline each belong to one thread; different ones may be used by different threads.
//
// Lost device: once a call reports a lost device, every object of that device may only be destroyed.

#include <glm/ext/vector_uint2.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/gpu/host_memory.hpp"
#include "rtstdb/gpu/shader.hpp"

namespace rtstdb::gpu {

class RasterPipeline;
class RasterTarget;
struct RasterTargetOptions;
enum class BeyondDepth : std::uint8_t;

enum class Memory : std::uint8_t {
  device,    ///< only shaders and copies access it
  upload,    ///< the host writes, shaders read; mapped and coherent
  readback,  ///< shaders write, the host reads; mapped, coherent, cached where the device has it
};

/// How a shader accesses a buffer. Texel fetches are much faster than storage loads on lavapipe, so shaders
/// read through texel views. A pass that writes the same buffer may bind it as storage.
enum class View : std::uint8_t { storage, texel_uint4, texel_float4 };

struct BufferOptions {
  std::string name;  ///< for validation messages and frame captures
  std::size_t size_bytes = 0;
  Memory memory = Memory::device;
  bool texel_uint4 = false;   ///< may be bound as View::texel_uint4
  bool texel_float4 = false;  ///< may be bound as View::texel_float4
  /// With texel_uint4: may also be bound as a storage texel buffer (imageLoad, imageStore)
  bool texel_image = false;
  bool indirect = false;   ///< may hold the group counts of an indirect dispatch, or draw commands
  bool addressed = false;  ///< shaders may access it by its device address
  /// Backs the buffer with this memory of at least size_bytes, which must outlive the buffer. Requires
  /// Memory::upload or readback. A device that can not import host memory works on a copy; flush() and
  /// invalidate() then copy.
  const HostMemory* host = nullptr;
};

class Buffer {
 public:
  Buffer();
  ~Buffer();
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  std::size_t size_bytes() const noexcept;
  /// The bytes that the host sees. Misuse: a buffer of Memory::device.
  std::span<std::byte> host() const noexcept;
  /// For a buffer with BufferOptions::host: flush() makes the host's writes to the range visible to later
  /// submissions, invalidate() makes the device's finished writes visible to the host. Both do nothing where
  /// the device imported the memory. Misuse: a buffer without BufferOptions::host; a range beyond its end.
  void flush(std::size_t offset_bytes, std::size_t size_bytes) const noexcept;
  void invalidate(std::size_t offset_bytes, std::size_t size_bytes) const noexcept;
  /// The device address of a byte, low word first. Accesses through it are not bounds checked. Misuse: a
  /// buffer that is not `addressed`; an offset beyond its end.
  glm::uvec2 address(std::size_t offset_bytes = 0) const noexcept;
  template <class T>
  std::span<T> host_as() const noexcept {
    const auto bytes = host();
    return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// A buffer to create, and the object that receives it.
struct BufferRequest {
  Buffer* buffer = nullptr;
  BufferOptions options;
};

/// The range that a storage binding covers; a texel binding always covers the whole buffer. Offsets are
/// multiples of DeviceLimits::storage_alignment_bytes.
struct BufferPart {
  const Buffer* buffer = nullptr;
  std::size_t offset_bytes = 0;
  std::size_t size_bytes = 0;  ///< 0: to the end of the buffer
};

/// A compute shader that is ready to dispatch.
class Pipeline {
 public:
  Pipeline();
  ~Pipeline();
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  std::uint32_t group_size() const noexcept;
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// The buffers of one pipeline's bindings, in the order of the shader table's letters. The buffers must
/// outlive it.
class Bindings {
 public:
  Bindings();
  ~Bindings();
  Bindings(Bindings&&) noexcept;
  Bindings& operator=(Bindings&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// Records commands into one command buffer, which may be submitted any number of times, one submission at a
/// time. A submission sees everything that earlier submissions to the same device wrote, so barriers are
/// needed only between commands of one recorder. Pipelines, bindings and buffers must live until the last
/// submission of a recorder that uses them has finished. Destroying a recorder waits for its submission. No
/// call allocates host memory of this library after creation.
class Recorder {
 public:
  Recorder();
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }

  static constexpr std::uint32_t max_timestamps = 16;

  /// Discards what was recorded and starts recording. Misuse: a submission of this recorder has not finished.
  void begin();
  /// Dispatches `groups` workgroups of the pipeline's group size, at most DeviceLimits::max_groups; 0 records
  /// nothing. `push_constants` are the bytes of the shader's argument struct, or {} for a shader without one.
  void dispatch(const Pipeline& pipeline, const Bindings& bindings, std::span<const std::byte> push_constants,
                std::uint32_t groups);
  template <class Args>
  requires(std::is_trivially_copyable_v<Args> &&
           !std::is_convertible_v<Args, std::span<const std::byte>>) void dispatch(const Pipeline& pipeline,
                                                                                   const Bindings& bindings,
                                                                                   const Args& args,
                                                                                   std::uint32_t groups) {
    dispatch(pipeline, bindings, std::as_bytes(std::span(&args, 1)), groups);
  }
  /// Reads the three uint32 group counts at `offset_bytes` of `counts` when it executes. The offset is a
  /// multiple of 4 and `counts` was created with `indirect`. The shader that writes the counts must not
  /// exceed DeviceLimits::max_groups.
  void dispatch_indirect(const Pipeline& pipeline, const Bindings& bindings,
                         std::span<const std::byte> push_constants, const Buffer& counts,
                         std::size_t offset_bytes);
  template <class Args>
  requires(std::is_trivially_copyable_v<Args> &&
           !std::is_convertible_v<
               Args, std::span<const std::byte>>) void dispatch_indirect(const Pipeline& pipeline,
                                                                         const Bindings& bindings,
                                                                         const Args& args,
                                                                         const Buffer& counts,
                                                                         std::size_t offset_bytes) {
    dispatch_indirect(pipeline, bindings, std::as_bytes(std::span(&args, 1)), counts, offset_bytes);
  }
  /// Clears the target, and executes `count` DrawCommands (raster.hpp) from the begin of `commands`.
  /// `push_constants` are the argument struct of the vertex shader. Misuse: a pipeline without fragments
  /// and a target with words, or the reverse; more commands than the buffer holds.
  void draw(const RasterPipeline& pipeline, const Bindings& bindings,
            std::span<const std::byte> push_constants, const RasterTarget& target, const Buffer& commands,
            std::uint32_t count);
  /// Copies what the last draw into the target left to a buffer, row by row from the top: two words, or a
  /// float, for each pixel.
  void copy_words(const RasterTarget& target, const Buffer& to, std::size_t offset_bytes);
  void copy_depth(const RasterTarget& target, const Buffer& to, std::size_t offset_bytes);
  /// Commands after the barrier start when those before it have finished, and see what they wrote. Without a
  /// barrier two commands may run at once. The host needs no barrier to read after the submission has
  /// finished.
  void barrier();
  /// Copies bytes between two buffers. 0 bytes record nothing. Misuse: a range beyond a buffer's end. The
  /// ranges must not overlap.
  void copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
            std::size_t size_bytes);
  /// Fills a range with copies of `word`. Offset and size are multiples of 4.
  void fill(const Buffer& buffer, std::size_t offset_bytes, std::size_t size_bytes, std::uint32_t word);
  /// Stores the time at which all commands recorded before have finished. A slot is below max_timestamps and
  /// is used at most once per begin().
  void timestamp(std::uint32_t slot);
  void end();

  struct Impl;

 private:
  friend class Device;
  friend class Timeline;
  std::unique_ptr<Impl> impl_;
};

enum class WaitResult : std::uint8_t { done, timeout, lost };

/// An ordered queue of submissions. Each submission has a number, and submissions finish in the order of
/// their numbers. Several timelines of one device share its queue, so a submit() may wait for that of another
/// timeline. Destroying a timeline waits for its submissions.
class Timeline {
 public:
  Timeline();
  ~Timeline();
  Timeline(Timeline&&) noexcept;
  Timeline& operator=(Timeline&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }

  /// Submits what the recorder holds. Returns the submission's number, counted from 1, or 0 when the device
  /// is lost. Every failure counts as a lost device, since the state of the submitted work is then unknown.
  /// Misuse: end() was not called; the recorder's last submission has not finished.
  std::uint64_t submit(Recorder& recorder);
  /// Waits until the submission has finished, for at most `timeout_ns`; 0 or less polls. Number 0 has always
  /// finished, or is lost when the device is. Misuse: a number that submit() has not returned.
  WaitResult wait(std::uint64_t number, std::int64_t timeout_ns);
  /// Nanoseconds from one timestamp to another of the recorder's last submission; negative when `to_slot` is
  /// earlier; 0 when the device is lost. Misuse: the submission has not finished, or lacks a timestamp.
  std::int64_t elapsed_ns(const Recorder& recorder, std::uint32_t from_slot, std::uint32_t to_slot) const;

  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::shared_ptr<Impl> impl_;  // shared: a submitted recorder refers to it
};

struct Kernel;

struct DeviceOptions {
  std::string select = "auto";  ///< see DatabaseOptions::gpu: "auto", an index, or a part of a name
  bool validation = false;
  /// The Vulkan loader, opened at run time and never closed. Tests replace it by one that fails on demand.
  std::string loader_library = "libvulkan.so.1";
  std::vector<std::byte> pipeline_cache =
      {};  ///< data of Device::pipeline_cache_data to start from; empty: none
  /// False: never import host memory, as on a device that can not (for tests)
  bool imports_host_memory = true;
  bool draws = true;                 ///< false: as on a device that can not draw (for tests)
  bool use_subgroup_kernels = true;  ///< false: never use kernels for a given subgroup size (for tests)
  std::uint32_t processors = 0;      ///< overrides DeviceLimits::processors; 0: as detected
  /// One device for all callers of this process with the same options; it is never closed (for tests, which
  /// open hundreds of databases).
  bool shared = false;
};

struct DeviceLimits {
  std::size_t max_storage_range_bytes = 0;
  std::size_t storage_alignment_bytes = 1;
  std::size_t max_texel_elements = 0;
  std::uint32_t max_groups = 0;  ///< workgroups of one dispatch
  std::size_t max_allocation_bytes = 0;
  std::uint32_t processors =
      0;  ///< number of workgroups that a software device runs at a time; 0: not a software device
  std::uint32_t max_raster_side = 0;  ///< of a RasterTarget; 0: the device can not draw
  std::uint32_t subgroup_size = 0;    ///< lanes of a subgroup; 0 with DeviceOptions::use_subgroup_kernels off
};

class Device {
 public:
  /// Opens a device. The driver creates all its threads inside this call; they inherit the caller's
  /// scheduling policy and affinity, and the caller's own stay unchanged (see README.md of this folder).
  /// Errors: no_device, with what was sought, what was found and what to install.
  static Result<std::unique_ptr<Device>> open(const DeviceOptions& options);
  /// All devices that the loader lists, in the order of their indices, including those that open() refuses.
  /// Empty: none.
  static std::vector<DeviceInfo> list();
  ~Device();

  const DeviceInfo& info() const noexcept;
  const DeviceLimits& limits() const noexcept;
  bool lost() const noexcept;
  /// The errors and warnings of the validation layer so far, each text once; empty without validation. Any
  /// thread may call this.
  std::vector<std::string> validation_messages() const;

  /// Creates a buffer with undefined contents. Errors: capacity (names the exceeded limit), out_of_memory,
  /// device_lost. Misuse: size 0; texel views and a size that is not a multiple of 16.
  Result<Buffer> create_buffer(const BufferOptions& options);
  /// Creates the buffers in order and stops at the first error; buffers before it exist.
  Result<void> create_buffers(std::span<const BufferRequest> wanted);
  /// On: pipelines are compiled at their first dispatch, so creating them is fast. A compilation that fails
  /// then counts as a lost device. Off by default.
  void compile_on_first_dispatch(bool late) noexcept;
  /// The driver's pipeline cache, to pass to another device as DeviceOptions::pipeline_cache. A lost device
  /// also returns it. Empty where the driver does not give it.
  std::vector<std::byte> pipeline_cache_data() const;
  bool compiles_on_first_dispatch() const noexcept;
  /// Compiles a shader of the table. Asserts that bindings, push constants and group size reflected from its
  /// SPIR-V equal the table's. Errors: capacity (group size), out_of_memory, device_lost.
  Result<Pipeline> create_pipeline(ShaderId shader);
  Result<Pipeline> create_pipeline(const ShaderInfo& shader);  ///< a shader of another table, for tests
  /// Binds `buffers` in the order of the shader's bindings. Errors: capacity (a storage range above
  /// DeviceLimits::max_storage_range_bytes), out_of_memory, device_lost. Misuse: a buffer without the view
  /// that the table names; a part that exceeds its buffer.
  Result<Bindings> create_bindings(const Pipeline& pipeline, std::span<const Buffer* const> buffers);
  Result<Bindings> create_bindings(const Pipeline& pipeline, std::span<const BufferPart> parts);
  /// Only on a device that can draw. The fragment shader has neither bindings nor push constants; without one
  /// the pipeline writes depth alone. Errors: out_of_memory, device_lost; for a target also capacity.
  Result<RasterPipeline> create_raster_pipeline(const ShaderInfo& vertex, const ShaderInfo* fragment,
                                                BeyondDepth beyond);
  Result<RasterTarget> create_raster_target(const RasterTargetOptions& options);
  /// Binds `buffers` in the order of the vertex shader's bindings. Errors and misuse as above.
  Result<Bindings> create_bindings(const RasterPipeline& pipeline, std::span<const Buffer* const> buffers);
  Result<Recorder> create_recorder();
  Result<Timeline> create_timeline();

  struct Impl;

 private:
  explicit Device(std::shared_ptr<Impl> impl);
  static Result<std::shared_ptr<Impl>> open_impl(const DeviceOptions& options);
  Result<Pipeline> create_pipeline(const ShaderInfo& shader, std::shared_ptr<Kernel>& kernel);
  struct BindingPlan;
  Result<Bindings> create_bindings(const BindingPlan& plan, std::span<const BufferPart> wanted);
  std::shared_ptr<Impl> impl_;  // shared: every object of the device keeps it alive
};

}  // namespace rtstdb::gpu
