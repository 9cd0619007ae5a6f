# Debian's OpenImageIO target names header folders of packages that OpenImageIO only recommends (OpenCV). CMake refuses folders that do not
# exist, so those are dropped from the target; none of the headers we use needs them.
function(penumbra_drop_missing_includes target)
  get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
  set(present "")
  foreach(folder IN LISTS folders)
    if(EXISTS "${folder}")
      list(APPEND present "${folder}")
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${present}")
endfunction()
