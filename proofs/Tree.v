(** The checker of subdivision trees in preorder, and its soundness.

    A tree says how an interval is cut into halves, and what holds on each leaf.  What
    is known of an interval is its content: polynomials, with halves of their own. *)

Require Import Reals Lra Lia ZArith List Bool.
Import ListNotations.

Inductive step (Mark : Type) := Split | Leaf (m : Mark).
Arguments Split {Mark}.
Arguments Leaf {Mark} m.

Section Tree.
  Variables (Content Mark : Type) (first second : Content -> Content).
  Variable holds : Mark -> Content -> bool.

  (** ** The algorithm *)

  (** The part of the interval from k/2^d to (k+1)/2^d. *)
  Record cell := Cell { place : Z; depth : nat; content : Content }.

  Definition first_cell (c : cell) : cell :=
    Cell (2 * place c) (S (depth c)) (first (content c)).
  Definition second_cell (c : cell) : cell :=
    Cell (2 * place c + 1) (S (depth c)) (second (content c)).

  Definition leaf : Type := Mark * Z * nat.

  (** Cells yet to be marked, from left to right; the steps; the leaves. *)
  Fixpoint check (cells : list cell) (steps : list (step Mark)) : option (list leaf) :=
    match steps, cells with
    | [], [] => Some []
    | Split :: r, c :: cs => check (first_cell c :: second_cell c :: cs) r
    | Leaf m :: r, c :: cs =>
        if holds m (content c)
        then option_map (cons (m, place c, depth c)) (check cs r)
        else None
    | _, _ => None
    end.

  Definition check_tree (c : Content) (steps : list (step Mark)) : option (list leaf) :=
    check [Cell 0 0 c] steps.

  (** ** Its soundness *)

  Open Scope R_scope.

  (** [known a b c]: what [c] says is so from [a] to [b]. *)
  Variables (known : R -> R -> Content -> Prop) (says : Mark -> R -> R -> Prop).
  Hypothesis first_known : forall a b c, known a b c -> known a ((a + b) / 2) (first c).
  Hypothesis second_known : forall a b c, known a b c -> known ((a + b) / 2) b (second c).
  Hypothesis holds_sound : forall m a b c, a < b -> known a b c -> holds m c = true -> says m a b.

  Definition start (k : Z) (d : nat) : R := IZR k / 2 ^ d.


  (** The leaves follow each other from [a] to [b], and each is true. *)
  Inductive tiles : R -> R -> list leaf -> Prop :=
    | tiles_none : forall a, tiles a a []
    | tiles_leaf : forall b m k d r, says m (start k d) (start (k + 1) d) ->
        tiles (start (k + 1) d) b r -> tiles (start k d) b ((m, k, d) :: r).

  (** Cells follow each other from [a] to [b], and what they say is so. *)
  Inductive row : R -> R -> list cell -> Prop :=
    | row_none : forall a, row a a []
    | row_cell : forall b k d c r, known (start k d) (start (k + 1) d) c ->
        row (start (k + 1) d) b r -> row (start k d) b (Cell k d c :: r).

  Lemma pow2 : forall d, 0 < 2 ^ d.
  Proof. intros; apply pow_lt; lra. Qed.

  Lemma start_next : forall k d, start k d < start (k + 1) d.
  Proof.
    intros; unfold start; rewrite plus_IZR; pose proof (pow2 d).
    apply Rmult_lt_compat_r; [apply Rinv_0_lt_compat; auto | lra].
  Qed.

  Lemma start_double : forall k d, start (2 * k) (S d) = start k d.
  Proof. intros; unfold start; rewrite mult_IZR; simpl; field; pose proof (pow2 d); lra. Qed.

  Lemma start_middle : forall k d,
    start (2 * k + 1) (S d) = (start k d + start (k + 1) d) / 2.
  Proof.
    intros; unfold start; rewrite !plus_IZR, mult_IZR; simpl; field; pose proof (pow2 d); lra.
  Qed.

  Lemma split_row : forall b k d c r, row (start k d) b (Cell k d c :: r) ->
    row (start k d) b (first_cell (Cell k d c) :: second_cell (Cell k d c) :: r).
  Proof.
    intros b k d c r H; inversion H as [|b' k' d' c' r' F R Es Eb]; subst.
    assert (E : start (2 * k + 1 + 1) (S d) = start (k + 1) d)
      by (rewrite <- (start_double (k + 1) d); f_equal; lia).
    unfold first_cell, second_cell; simpl place; simpl depth; simpl content.
    rewrite <- (start_double k d); constructor; [|constructor; rewrite E; auto];
      rewrite ?E, ?start_double, ?start_middle; auto.
  Qed.

  Theorem check_sound : forall steps cells a b leaves, row a b cells ->
    check cells steps = Some leaves -> tiles a b leaves.
  Proof.
    induction steps as [|[|m] r IH]; intros [|c cs] a b leaves R H; try discriminate.
    - injection H as <-; inversion R; constructor.
    - inversion R; subst; eapply IH; [|exact H]; apply split_row; auto.
    - inversion R as [|b' k d q s K Rs]; subst; cbn in H.
      destruct (holds m q) eqn:Hm; [|discriminate].
      destruct (check cs r) as [l|] eqn:Hl; [|discriminate]; injection H as <-.
      constructor; [|eapply IH; eauto].
      apply (holds_sound m _ _ q); auto using start_next.
  Qed.

  Theorem check_tree_sound : forall c steps leaves, known 0 1 c ->
    check_tree c steps = Some leaves -> tiles 0 1 leaves.
  Proof.
    intros c steps leaves K H; apply (check_sound steps [Cell 0 0 c]); auto.
    assert (E0 : start 0 0 = 0) by (unfold start; simpl; lra).
    assert (E1 : start (0 + 1) 0 = 1) by (unfold start; simpl; lra).
    rewrite <- E0 at 1; constructor; rewrite ?E0, E1; auto; constructor.
  Qed.

  (** Every time of the interval lies in a leaf. *)
  Lemma tiles_cover : forall a b leaves x, tiles a b leaves -> a <= x <= b -> leaves <> [] ->
    exists m k d, In (m, k, d) leaves /\ start k d <= x <= start (k + 1) d
      /\ says m (start k d) (start (k + 1) d).
  Proof.
    intros a b leaves x T; revert x; induction T as [|b m k d r H T IH]; intros x Hx NE;
      [congruence|].
    destruct (Rle_lt_dec x (start (k + 1) d)) as [L|L].
    - exists m, k, d; repeat split; [left | ..]; auto; lra.
    - destruct r as [|l r]; [inversion T; subst; lra|].
      destruct (IH x) as (m' & k' & d' & I & B); [lra | discriminate|].
      exists m', k', d'; split; [right; auto | auto].
  Qed.
End Tree.
