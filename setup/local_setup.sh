# shellcheck shell=sh disable=SC2154
# Sourced by install/setup.{sh,bash,zsh}, which colcon writes: makes the virtual environment the underlay of the
# workspace, as /opt/ros/jazzy is elsewhere.
_relform_prefix="${COLCON_CURRENT_PREFIX:-$VIRTUAL_ENV}"
case ":$PATH:" in *":$_relform_prefix/bin:"*) ;; *) export PATH="$_relform_prefix/bin:$PATH" ;; esac
for _relform_variable in AMENT_PREFIX_PATH CMAKE_PREFIX_PATH; do
    eval "_relform_value=\"\${$_relform_variable:-}\""
    case ":$_relform_value:" in
    *":$_relform_prefix:"*) ;;
    *) export "$_relform_variable=$_relform_prefix${_relform_value:+:$_relform_value}" ;;
    esac
done
# Completions of ros2, where the shell can complete and has none.
if [ -n "${BASH_VERSION:-}" ]; then
    complete -p ros2 >/dev/null 2>&1 || . "$_relform_prefix/ros2-completion.sh"
elif [ -n "${ZSH_VERSION:-}" ] && type compdef >/dev/null 2>&1; then
    . "$_relform_prefix/ros2-completion.sh"
fi
unset _relform_prefix _relform_variable _relform_value
