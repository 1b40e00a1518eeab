# hil_sanitizer_options: for every program that opens a Vulkan device. With the address sanitizer it excludes
# the driver's leaks; otherwise it is empty.
if(HIL_SANITIZE MATCHES "address")
  add_library(hil_sanitizer_options OBJECT ${CMAKE_CURRENT_LIST_DIR}/sanitizer_options.cpp)
  target_link_libraries(hil_sanitizer_options PRIVATE hil_compile_options PUBLIC ${CMAKE_DL_LIBS})
else()
  add_library(hil_sanitizer_options INTERFACE)
endif()
