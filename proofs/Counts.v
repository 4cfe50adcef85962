(** Robots that are not followed: how many of them must and how many may satisfy a combination. *)

Require Import List Bool Arith Lia.
From LtlPlan Require Import Progression.
Import ListNotations.

Section Counts.
  Variable satisfies : letter -> bool.

  Fixpoint count {A} (f : A -> bool) (l : list A) : nat :=
    match l with [] => 0 | x :: r => (if f x then 1 else 0) + count f r end.

  (** Each robot shows one of the letters that it may show. *)
  Definition shown_by (may : list (list letter)) (letters : list letter) : Prop :=
    Forall2 (fun m a => In a m) may letters.

  Definition must (may : list (list letter)) : nat := count (forallb satisfies) may.
  Definition most (may : list (list letter)) : nat := count (existsb satisfies) may.

  Theorem counted_between : forall may letters, shown_by may letters ->
    must may <= count satisfies letters <= most may.
  Proof.
    unfold must, most; induction 1 as [|m a may letters I H IH]; cbn; [lia|].
    assert (F : forallb satisfies m = true -> satisfies a = true)
      by (intros E; rewrite forallb_forall in E; auto).
    assert (S : satisfies a = true -> existsb satisfies m = true)
      by (intros E; apply existsb_exists; eauto).
    destruct (forallb satisfies m), (satisfies a), (existsb satisfies m); try lia;
      try (discriminate (F eq_refl)); discriminate (S eq_refl).
  Qed.

  (** What the team shows of thresholds is among what it shows for a number in between. *)
  Definition reached (thresholds : list (nat * nat)) (total : nat) : letter :=
    map fst (filter (fun one => snd one <=? total) thresholds).

  Theorem counted_letters : forall thresholds own may letters, shown_by may letters ->
    In (reached thresholds (own + count satisfies letters))
      (map (reached thresholds) (seq (own + must may) (S (most may - must may)))).
  Proof.
    intros thresholds own may letters H; apply in_map, in_seq.
    pose proof (counted_between may letters H); lia.
  Qed.
End Counts.
