# Shaders are embedded in the programs as arrays of words: glslangValidator compiles them,
# spirv-opt optimizes them and spirv-val checks them. GLSL includes files by their path in the repository
# ("shaders/shared/interop.h") or under shaders/.
find_program(GLSLANG_VALIDATOR glslangValidator REQUIRED)
find_program(SPIRV_OPT spirv-opt REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

# Optimization at build time saves the driver time at the first dispatch. These variants are not optimized,
# since that makes no difference in their benches.
set(HIL_SHADERS_AS_COMPILED "^(region|nearest_center)")

# Compiles one shader into `directory`/`name`.h, which defines `const uint32_t name_words[]`, and puts that
# path into `result`. Further arguments are options of glslangValidator, such as -DNAME=value.
function(hil_compile_shader result directory name source)
  set(words ${directory}/${name}.h)
  set(binary ${directory}/${name}.spv)
  set(passes -O)
  if(name MATCHES "${HIL_SHADERS_AS_COMPILED}")
    set(passes "")
  endif()
  add_custom_command(
    OUTPUT ${binary} ${words}
    COMMAND ${GLSLANG_VALIDATOR} -V --quiet --target-env vulkan1.3
            -I${PROJECT_SOURCE_DIR} -I${PROJECT_SOURCE_DIR}/shaders
            ${ARGN} --depfile ${words}.d -o ${binary} ${source}
    COMMAND ${SPIRV_OPT} --target-env=vulkan1.3 --scalar-block-layout --preserve-bindings ${passes}
            ${binary} -o ${binary}
    COMMAND ${SPIRV_VAL} --target-env vulkan1.3 --scalar-block-layout ${binary}
    COMMAND ${CMAKE_COMMAND} -DNAME=${name} -DBINARY=${binary} -DWORDS=${words}
            -P ${PROJECT_SOURCE_DIR}/cmake/shader_words.cmake
    DEPENDS ${source} ${PROJECT_SOURCE_DIR}/cmake/shader_words.cmake
    DEPFILE ${words}.d
    COMMENT "Shader ${name}"
    VERBATIM)
  set(${result} ${words} PARENT_SCOPE)
endfunction()

# Compiles every SHADER line of a table (rtstdb/gpu/shader.hpp gives the form; sources lie under `root`) and
# writes `directory`/words.inc, which defines name_words for each name. `target` builds them all.
function(hil_shader_table target table root directory)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${table})
  file(STRINGS ${table} lines REGEX "^ *SHADER\\(")
  set(headers "")
  set(includes "")
  set(missing "")
  foreach(line IN LISTS lines)
    set(columns "([a-z0-9_]+), *\"([^\"]+)\", *\"([A-Za-z0-9_= ]*)\", *[0-9]+, *[A-Za-z0-9_]+, *\"[STFI]*\"")
    if(NOT line MATCHES "^ *SHADER\\(${columns}\\)$")
      message(FATAL_ERROR "${table}: not a line of the form "
        "SHADER(name, \"source\", \"DEFINE NAME=value\", group_size, Args, \"STFI\"): ${line}")
    endif()
    set(name ${CMAKE_MATCH_1})
    set(source ${root}/${CMAKE_MATCH_2})
    separate_arguments(defines UNIX_COMMAND "${CMAKE_MATCH_3}")
    list(TRANSFORM defines PREPEND -D)
    if(NOT EXISTS ${source})
      list(APPEND missing ${source})
      continue()
    endif()
    hil_compile_shader(header ${directory} ${name} ${source} ${defines})
    list(APPEND headers ${header})
    string(APPEND includes "#include \"${header}\"\n")
  endforeach()
  if(missing)
    list(JOIN missing "\n  " missing)
    message(FATAL_ERROR "${table} names shaders that do not exist:\n  ${missing}")
  endif()
  file(CONFIGURE OUTPUT ${directory}/words.inc CONTENT "${includes}" @ONLY)
  add_custom_target(${target} DEPENDS ${headers})
endfunction()
