# Man pages and completions, which the program writes itself, of the tables behind --help: made when it is installed.
set(manuals ${PROJECT_BINARY_DIR}/manuals)
install(CODE "
  foreach(kind man bash zsh fish)
    execute_process(COMMAND $<TARGET_FILE:raylign> generate \${kind} -o ${manuals}/\${kind} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()" COMPONENT program)
set(zsh_folder site-functions)
if(EXISTS /etc/debian_version)
  set(zsh_folder vendor-completions)
endif()
install(DIRECTORY ${manuals}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(DIRECTORY ${manuals}/bash/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
install(DIRECTORY ${manuals}/zsh/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/${zsh_folder} COMPONENT program)
install(DIRECTORY ${manuals}/fish/ DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
