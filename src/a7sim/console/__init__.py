"""Console of the instrument in a terminal. It uses only the command language."""
