"""Evidence: concealed cases made, diagnosed blindly and scored; the thesis retold."""
