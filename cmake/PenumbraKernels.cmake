# Kernels: embedded into the library, and compiled by clang for every specialisation when the library is built.

set(PENUMBRA_KERNELS_DIR ${CMAKE_SOURCE_DIR}/kernels)

# penumbra_embed_kernels(TARGET CONSUMER): TARGET is an interface library that gives the target called CONSUMER, and no other, one generated
# C++ file with the bytes of every kernel. (Linked transitively it would define them again in each executable.)
function(penumbra_embed_kernels target consumer)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS RELATIVE ${PENUMBRA_KERNELS_DIR}
    ${PENUMBRA_KERNELS_DIR}/*.cl ${PENUMBRA_KERNELS_DIR}/*.clh ${PENUMBRA_KERNELS_DIR}/common/*.h)
  list(SORT files)
  set(paths ${files})
  list(TRANSFORM paths PREPEND ${PENUMBRA_KERNELS_DIR}/)
  list(JOIN files "|" joined)
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/kernel_files.cpp)

  add_custom_command(OUTPUT ${generated}
    COMMAND ${CMAKE_COMMAND} -DROOT=${PENUMBRA_KERNELS_DIR} -DFILES=${joined} -DOUTPUT=${generated} -P ${CMAKE_SOURCE_DIR}/cmake/embed_kernels.cmake
    DEPENDS ${paths} ${CMAKE_SOURCE_DIR}/cmake/embed_kernels.cmake
    COMMENT "Embedding the kernels"
    VERBATIM)
  add_custom_target(${target}_embedded DEPENDS ${generated})

  add_library(${target} INTERFACE)
  target_sources(${target} INTERFACE $<$<STREQUAL:$<TARGET_PROPERTY:NAME>,${consumer}>:${generated}>)
  add_dependencies(${target} ${target}_embedded)
  set_property(GLOBAL PROPERTY PENUMBRA_KERNEL_PATHS ${paths})
endfunction()

# penumbra_offline_compile(EXECUTABLE): a target `kernels_checked`, part of `all`, that compiles every specialisation. EXECUTABLE prints one a
# line, as in "soft_shadow_map.cl -DLANES=16 -DACCUMULATOR=0". Needs clang; without it the check is left out, and said so.
find_program(PENUMBRA_CLANG NAMES clang clang-19 clang-18 clang-17 clang-16 clang-15 clang-14 DOC "Compiles the kernels for the build's check")

function(penumbra_offline_compile executable)
  if(NOT PENUMBRA_CLANG)
    message(STATUS "clang not found: kernels are not checked at build time")
    return()
  endif()
  get_property(paths GLOBAL PROPERTY PENUMBRA_KERNEL_PATHS)
  set(stamp ${CMAKE_CURRENT_BINARY_DIR}/kernels_checked.stamp)
  add_custom_command(OUTPUT ${stamp}
    COMMAND sh ${CMAKE_SOURCE_DIR}/cmake/compile_kernels.sh ${PENUMBRA_CLANG} ${PENUMBRA_KERNELS_DIR} $<TARGET_FILE:${executable}>
    COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
    DEPENDS ${executable} ${paths} ${CMAKE_SOURCE_DIR}/cmake/compile_kernels.sh
    COMMENT "Compiling every kernel for every specialisation"
    VERBATIM)
  add_custom_target(kernels_checked ALL DEPENDS ${stamp})
endfunction()
