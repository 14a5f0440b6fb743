const VERSION = "rayfold-0123456789abcdef";
